//! A curve from a reference in motion to a point at rest.

use super::velocity::wrapped;
use super::{FlightLimits, PositionFence};
use crate::Reference;
use crate::polynomial::{Endpoint, PEAK_ACCELERATION, PEAK_JERK, PEAK_SPEED, Polynomial};
use glam::Vec3;

/// Shortest duration in seconds.
const DURATION_S_MIN: f32 = 0.1;
/// Durations that the search tries.
const TRIES: usize = 14;
/// Growth of the duration from one try to the next.
const GROWTH: f32 = 1.25;
/// Share of a limit below which a start counts as rest, for which the peaks have a closed form.
const REST_SHARE: f32 = 1e-3;

/// A point where the robot should come to rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FlightGoal {
    /// Position in m.
    pub position_m: Vec3,
    /// Yaw in radians.
    pub yaw_rad: f32,
    /// Shortest duration in seconds, if the caller wants one.
    pub duration_s: Option<f32>,
}

/// A curve to a goal. Position and yaw may take different durations; the shorter one then waits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Curve {
    position: Polynomial<Vec3>,
    yaw: Polynomial<f32>,
    fence: PositionFence,
}

impl Curve {
    /// Returns the shortest curve found that keeps the limits and the fence.
    ///
    /// Returns `None` if no duration that was tried permits one. A start at rest always has a curve
    /// if the goal is inside the fence.
    pub fn find(
        start: &Reference,
        goal: &FlightGoal,
        limits: &FlightLimits,
        fence: &PositionFence,
    ) -> Option<Curve> {
        let fence = fence.extended_to(start.position_m);
        let from = Endpoint {
            position: start.position_m,
            velocity: start.velocity_m_s,
            acceleration: start.acceleration_m_s2,
        };
        let to = Endpoint::at_rest(goal.position_m);
        let shortest = move_duration_s(goal.position_m - start.position_m, limits);
        let is_at_rest = start.velocity_m_s.length()
            <= REST_SHARE * limits.speed_m_s.min(limits.climb_m_s)
            && start.acceleration_m_s2.length() <= REST_SHARE * limits.acceleration_m_s2;
        let mut duration_s = shortest.max(goal.duration_s.unwrap_or(0.0));
        for _ in 0..TRIES {
            let position = Polynomial::between(from, to, duration_s)?;
            if is_at_rest || is_allowed(&position, limits, &fence) {
                let yaw = yaw_curve(start, goal.yaw_rad, duration_s, limits)?;
                return Some(Curve { position, yaw, fence });
            }
            duration_s *= GROWTH;
        }
        None
    }

    /// Returns the duration in seconds.
    pub fn duration_s(&self) -> f32 {
        self.position.duration_s().max(self.yaw.duration_s())
    }

    /// Returns the reference at a time after the start, and the goal after the end.
    pub fn at(&self, time_s: f32) -> Reference {
        let mut reference = reference_at(&self.position, &self.yaw, time_s);
        reference.position_m = self.fence.clamp(reference.position_m);
        reference
    }
}

/// Returns the reference on two polynomials.
pub(super) fn reference_at(
    position: &Polynomial<Vec3>,
    yaw: &Polynomial<f32>,
    time_s: f32,
) -> Reference {
    let [position_m, velocity_m_s, acceleration_m_s2, jerk_m_s3, snap_m_s4] = position.at(time_s);
    let [yaw_rad, yaw_rate_rad_s, ..] = yaw.at(time_s);
    let mut reference = Reference {
        position_m,
        velocity_m_s,
        acceleration_m_s2,
        jerk_m_s3,
        snap_m_s4,
        yaw_rad: wrapped(yaw_rad),
        yaw_rate_rad_s,
    };
    if time_s > position.duration_s() {
        // After its end a polynomial holds its last value, but the snap there is not zero.
        reference.snap_m_s4 = Vec3::ZERO;
    }
    reference
}

/// Returns true if a polynomial keeps the limits and the fence.
fn is_allowed(position: &Polynomial<Vec3>, limits: &FlightLimits, fence: &PositionFence) -> bool {
    position.hull_is_inside(1, |velocity| limits.allow_velocity(velocity))
        && position.hull_is_inside(2, |acceleration| limits.allow_acceleration(acceleration))
        && position.hull_is_inside(3, |jerk| limits.allow_jerk(jerk))
        && position.hull_is_inside(0, |point| fence.nearly_contains(point))
}

/// Returns the shortest duration in seconds from rest at a start to a goal.
pub(super) fn duration_from_rest_s(
    start: &Reference,
    goal: &FlightGoal,
    limits: &FlightLimits,
) -> f32 {
    let turn_rad = wrapped(goal.yaw_rad - start.yaw_rad);
    move_duration_s(goal.position_m - start.position_m, limits)
        .max(turn_duration_s(turn_rad, limits))
        .max(goal.duration_s.unwrap_or(0.0))
}

/// Returns the shortest duration in seconds from rest to rest over a displacement.
fn move_duration_s(displacement_m: Vec3, limits: &FlightLimits) -> f32 {
    let distance_m = displacement_m.length();
    DURATION_S_MIN
        .max(PEAK_SPEED * displacement_m.truncate().length() / limits.speed_m_s)
        .max(PEAK_SPEED * libm::fabsf(displacement_m.z) / limits.climb_m_s)
        .max(libm::sqrtf(PEAK_ACCELERATION * distance_m / limits.acceleration_m_s2))
        .max(libm::cbrtf(PEAK_JERK * distance_m / limits.jerk_m_s3))
}

/// Returns the shortest duration in seconds from rest to rest over a turn.
fn turn_duration_s(turn_rad: f32, limits: &FlightLimits) -> f32 {
    let angle_rad = libm::fabsf(turn_rad);
    let by_rate_s = PEAK_SPEED * angle_rad / limits.yaw_rate_rad_s;
    by_rate_s.max(libm::sqrtf(PEAK_ACCELERATION * angle_rad / limits.yaw_acceleration_rad_s2()))
}

/// Returns the curve of the yaw on the short way, which takes at least `duration_s`.
fn yaw_curve(
    start: &Reference,
    yaw_rad: f32,
    duration_s: f32,
    limits: &FlightLimits,
) -> Option<Polynomial<f32>> {
    let turn_rad = wrapped(yaw_rad - start.yaw_rad);
    let from =
        Endpoint { position: start.yaw_rad, velocity: start.yaw_rate_rad_s, acceleration: 0.0 };
    let to = Endpoint::at_rest(start.yaw_rad + turn_rad);
    let is_at_rest = libm::fabsf(start.yaw_rate_rad_s) <= REST_SHARE * limits.yaw_rate_rad_s;
    let mut duration_s = duration_s.max(turn_duration_s(turn_rad, limits));
    // A long curve only has to undo the rate at the start, which never needs a larger rate: so the
    // search ends.
    for _ in 0..TRIES {
        let yaw = Polynomial::between(from, to, duration_s)?;
        let is_allowed = yaw.hull_is_inside(1, |rate| limits.allow_yaw_rate(rate))
            && yaw.hull_is_inside(2, |acceleration| limits.allow_yaw_acceleration(acceleration));
        if is_at_rest || is_allowed {
            return Some(yaw);
        }
        duration_s *= GROWTH;
    }
    None
}
