//! A reference that follows a commanded velocity, within limits and in front of a fence.
//!
//! # Filter
//! A lead velocity w moves straight towards the command, by at most the acceleration A per second.
//! The velocity v of the reference follows with the rate ω = J / 2A: v' = ω (w - v). Then
//! * v and w stay in any convex set that contains both and the command, such as the limits of
//!   speed;
//! * the acceleration v' is a lag of w', so it is continuous and at most A;
//! * the jerk is ω (w' - v'), so it is at most 2 ω A = J.
//!
//! While w' is constant the equations have a closed form, so the result hardly depends on the
//! steps.
//!
//! # Fence
//! To brake, w shrinks towards zero by A per second. The reference then stops at
//! p + v/ω + w |w| / 2A. Without the parts of v and w that lead away from a wall, this sum bounds
//! the position towards the wall, and it never grows while the reference brakes. So a step is taken
//! only if the bound afterwards is inside the fence; otherwise the reference brakes. This holds for
//! every command. To slide along a wall without such braking, a command is first slowed down by its
//! distance to the wall.

use super::{FlightLimits, PositionFence};
use crate::Reference;
use core::f32::consts::{PI, TAU};
use glam::Vec3;

/// Longest step in seconds.
const STEP_S: f32 = 0.01;
/// Most steps for one reference; a longer gap takes longer steps.
const STEPS_MAX: f32 = 100.0;
/// Longest gap between two references in seconds; a longer one counts as this long.
const GAP_S_MAX: f32 = 60.0;
/// Samples of a stop that decide if braking is safe.
const STOP_SAMPLES: usize = 48;

/// The frame of a commanded velocity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VelocityFrame {
    /// The world frame.
    World,
    /// The world frame turned by the yaw of the reference, so that x leads ahead.
    Yaw,
}

/// A commanded velocity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VelocityCommand {
    /// Frame of the velocity.
    pub frame: VelocityFrame,
    /// Velocity in m/s.
    pub velocity_m_s: Vec3,
    /// Rate of yaw in rad/s.
    pub yaw_rate_rad_s: f32,
}

impl VelocityCommand {
    /// The command to stop.
    pub const STOP: Self = VelocityCommand {
        frame: VelocityFrame::World,
        velocity_m_s: Vec3::ZERO,
        yaw_rate_rad_s: 0.0,
    };

    /// Returns true if all numbers are finite.
    pub fn is_finite(&self) -> bool {
        self.velocity_m_s.is_finite() && self.yaw_rate_rad_s.is_finite()
    }
}

/// Returns an angle in radians that is turned by full circles into -π to π.
pub(crate) fn wrapped(angle_rad: f32) -> f32 {
    let turned = angle_rad - TAU * libm::roundf(angle_rad / TAU);
    turned.clamp(-PI, PI)
}

/// The state of the filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct VelocityFilter {
    position_m: Vec3,
    velocity_m_s: Vec3,
    lead_m_s: Vec3,
    /// Change of the lead in the last step.
    ramp_m_s2: Vec3,
    yaw_rad: f32,
    yaw_rate_rad_s: f32,
}

impl VelocityFilter {
    /// Returns a filter that continues a reference up to its acceleration.
    pub fn from_reference(start: &Reference, limits: &FlightLimits) -> Self {
        let lead = start.velocity_m_s + start.acceleration_m_s2 / limits.lag_rate_s();
        VelocityFilter {
            position_m: start.position_m,
            velocity_m_s: start.velocity_m_s,
            lead_m_s: lead,
            ramp_m_s2: start.acceleration_m_s2,
            yaw_rad: start.yaw_rad,
            yaw_rate_rad_s: start.yaw_rate_rad_s,
        }
    }

    /// Returns the reference of this moment.
    pub fn reference(&self, limits: &FlightLimits) -> Reference {
        let rate = limits.lag_rate_s();
        let acceleration = (self.lead_m_s - self.velocity_m_s) * rate;
        let jerk = (self.ramp_m_s2 - acceleration) * rate;
        Reference {
            position_m: self.position_m,
            velocity_m_s: self.velocity_m_s,
            acceleration_m_s2: acceleration,
            jerk_m_s3: jerk,
            snap_m_s4: jerk * -rate,
            yaw_rad: self.yaw_rad,
            yaw_rate_rad_s: self.yaw_rate_rad_s,
        }
    }

    /// Returns the position in m where the reference stops when it brakes now.
    pub fn stop_m(&self, limits: &FlightLimits) -> Vec3 {
        self.position_m
            + self.velocity_m_s / limits.lag_rate_s()
            + self.lead_m_s * (self.lead_m_s.length() / (2.0 * limits.acceleration_m_s2))
    }

    /// Returns an estimate of the duration in seconds until the reference stops when it brakes now.
    pub fn stop_s(&self, limits: &FlightLimits) -> f32 {
        // A lag decays to 2 % within 4 time constants.
        self.lead_m_s.length() / limits.acceleration_m_s2 + 4.0 / limits.lag_rate_s()
    }

    /// Returns true if the reference can brake from here within the limits and the fence.
    pub fn can_brake(&self, limits: &FlightLimits, fence: &PositionFence) -> bool {
        let fence = fence.extended_to(self.position_m);
        if self.bound_is_inside(limits, &fence) && limits.allow_velocity(self.lead_m_s) {
            return true;
        }
        let step_s = 1.5 * self.stop_s(limits) / STOP_SAMPLES as f32;
        let mut copy = *self;
        (0..STOP_SAMPLES).all(|_| {
            copy.brake(step_s, limits);
            limits.allow_velocity(copy.velocity_m_s) && fence.nearly_contains(copy.position_m)
        })
    }

    /// Moves the reference by a time that is 0 or more.
    pub fn advance(
        &mut self,
        time_s: f32,
        command: &VelocityCommand,
        limits: &FlightLimits,
        fence: &PositionFence,
    ) {
        let time_s = time_s.min(GAP_S_MAX);
        let steps = libm::ceilf(time_s / STEP_S).clamp(1.0, STEPS_MAX);
        for _ in 0..steps as usize {
            self.step(time_s / steps, command, limits, fence);
        }
    }

    fn step(
        &mut self,
        step_s: f32,
        command: &VelocityCommand,
        limits: &FlightLimits,
        fence: &PositionFence,
    ) {
        let fence = fence.extended_to(self.position_m);
        let mut target = limits.limit_velocity(command.velocity_m_s);
        if command.frame == VelocityFrame::Yaw {
            let ahead = glam::Vec2::new(libm::cosf(self.yaw_rad), libm::sinf(self.yaw_rad));
            target = ahead.rotate(target.truncate()).extend(target.z);
        }
        // With the distance d to a wall and the component c towards it, c (4/ω + |w|/A) ≤ d keeps
        // the bound inside with room to spare, and the factor 4 damps the approach critically.
        let slowness =
            4.0 / limits.lag_rate_s() + self.lead_m_s.length() / limits.acceleration_m_s2;
        target = target
            .min((fence.most_m() - self.position_m) / slowness)
            .max((fence.least_m() - self.position_m) / slowness);

        let most_change = limits.acceleration_m_s2 * step_s;
        let change = (target - self.lead_m_s).clamp_length_max(most_change);
        let mut next = *self;
        if step_s > 0.0 {
            next.integrate(step_s, change / step_s, limits);
        }
        let is_lead_allowed = limits.allow_velocity(self.lead_m_s);
        if is_lead_allowed && next.bound_is_inside(limits, &fence) {
            *self = next;
        } else {
            self.brake(step_s, limits);
        }
        // Rounding only.
        self.position_m = fence.clamp(self.position_m);

        let yaw_rate =
            command.yaw_rate_rad_s.max(-limits.yaw_rate_rad_s).min(limits.yaw_rate_rad_s);
        let decay = libm::expf(-limits.lag_rate_s() * step_s);
        let excess = self.yaw_rate_rad_s - yaw_rate;
        self.yaw_rad = wrapped(
            self.yaw_rad + yaw_rate * step_s + excess * (1.0 - decay) / limits.lag_rate_s(),
        );
        self.yaw_rate_rad_s = yaw_rate + excess * decay;
    }

    /// Moves the reference while the lead shrinks.
    fn brake(&mut self, step_s: f32, limits: &FlightLimits) {
        let speed = self.lead_m_s.length();
        let until_zero_s = step_s.min(speed / limits.acceleration_m_s2);
        if until_zero_s > 0.0 {
            let ramp = self.lead_m_s * (-limits.acceleration_m_s2 / speed);
            self.integrate(until_zero_s, ramp, limits);
        }
        if step_s > until_zero_s {
            self.lead_m_s = Vec3::ZERO;
            self.integrate(step_s - until_zero_s, Vec3::ZERO, limits);
        }
    }

    /// Moves the reference while the lead changes at a constant rate.
    fn integrate(&mut self, step_s: f32, ramp_m_s2: Vec3, limits: &FlightLimits) {
        let rate = limits.lag_rate_s();
        let lead = self.lead_m_s + ramp_m_s2 * step_s;
        let lag = ramp_m_s2 / rate;
        let decay = libm::expf(-rate * step_s);
        let velocity = lead - lag + (self.velocity_m_s - self.lead_m_s + lag) * decay;
        // The integral of v' = ω (w - v).
        self.position_m += self.lead_m_s * step_s + ramp_m_s2 * (0.5 * step_s * step_s)
            - (velocity - self.velocity_m_s) / rate;
        self.velocity_m_s = velocity;
        self.lead_m_s = lead;
        self.ramp_m_s2 = ramp_m_s2;
    }

    /// Returns true if the bound of the module's documentation is inside for every wall.
    fn bound_is_inside(&self, limits: &FlightLimits, fence: &PositionFence) -> bool {
        let by_velocity = limits.lag_rate_s().recip();
        let by_lead = self.lead_m_s.length() / (2.0 * limits.acceleration_m_s2);
        let forward = self.velocity_m_s.max(Vec3::ZERO) * by_velocity
            + self.lead_m_s.max(Vec3::ZERO) * by_lead;
        let backward = self.velocity_m_s.min(Vec3::ZERO) * by_velocity
            + self.lead_m_s.min(Vec3::ZERO) * by_lead;
        fence.nearly_contains(self.position_m + forward)
            && fence.nearly_contains(self.position_m + backward)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const LIMITS: FlightLimits = FlightLimits::CRAZYFLIE;

    /// Integrates the equations of the filter in `f64` by small steps, for one axis without a
    /// fence.
    fn brute_force(command: f64, time_s: f64) -> [f64; 3] {
        let (most, rate) = (4.0, 40.0 / 8.0);
        let (mut p, mut v, mut w) = (0.0, 0.0, 0.0_f64);
        let dt = 1e-5;
        for _ in 0..(time_s / dt).round() as usize {
            w += (command - w).clamp(-most * dt, most * dt);
            let a = rate * (w - v);
            p += v * dt + 0.5 * a * dt * dt;
            v += a * dt;
        }
        [p, v, rate * (w - v)]
    }

    fn along_x(speed_m_s: f32) -> VelocityCommand {
        VelocityCommand { velocity_m_s: Vec3::X * speed_m_s, ..VelocityCommand::STOP }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(40))]

        #[test]
        fn steps_solve_the_differential_equations(speed in -1.4_f32..1.4, time in 0.05_f32..2.0) {
            let mut filter = VelocityFilter::from_reference(&Reference::default(), &LIMITS);
            filter.advance(time, &along_x(speed), &LIMITS, &PositionFence::WIDE);
            let reference = filter.reference(&LIMITS);
            let [p, v, a] = brute_force(speed as f64, time as f64);
            // The lead reaches the command at the end of a step of 10 ms instead of inside it.
            prop_assert!((reference.position_m.x as f64 - p).abs() < 5e-4);
            prop_assert!((reference.velocity_m_s.x as f64 - v).abs() < 2e-3);
            prop_assert!((reference.acceleration_m_s2.x as f64 - a).abs() < 2e-2);
        }

        #[test]
        fn stop_is_where_it_was_predicted(speed in -1.5_f32..1.5, time in 0.0_f32..2.0) {
            let mut filter = VelocityFilter::from_reference(&Reference::default(), &LIMITS);
            filter.advance(time, &along_x(speed), &LIMITS, &PositionFence::WIDE);
            let stop = filter.stop_m(&LIMITS);
            let duration = filter.stop_s(&LIMITS);
            for _ in 0..1000 {
                filter.brake(0.005, &LIMITS);
            }
            prop_assert!(filter.position_m.distance(stop) < 1e-4, "{filter:?} {stop}");
            prop_assert!(duration < 5.0);
        }
    }

    #[test]
    fn angles_are_wrapped() {
        assert!((wrapped(PI + 0.5) + PI - 0.5).abs() < 1e-6);
        assert!((wrapped(-7.0) + 7.0 - TAU).abs() < 1e-6);
        assert_eq!(wrapped(1.0), 1.0);
    }
}
