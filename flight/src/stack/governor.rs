//! Governors of set-points that no planner has made: references and attitudes of a caller.
//!
//! Any finite number may come from a radio or a script. A governor moves its own set-point, which the
//! controller follows, toward that of the caller within the limits of the planner and of the fence. The
//! change of the acceleration is limited too: to reverse a tilt takes thrust, and a robot that gets
//! reversals all the time would lose its height.

use glam::{Vec2, Vec3};

use super::AttitudeCommand;
use crate::planner::{FlightLimits, PositionFence, wrapped};
use crate::{FlightState, GRAVITY_M_S2, Reference};

/// Speed per distance in 1/s, and acceleration per difference of speed in 1/s, with which a reference
/// closes on that of the caller. The damping is 0.7.
const CLOSING_1_S: f32 = 1.0;
const SPEED_GAIN_1_S: f32 = 2.5;
/// Rate of yaw per difference of yaw in 1/s.
const YAW_GAIN_1_S: f32 = 3.0;
/// Largest differences in m, m/s and m/s² of a reference that is followed exactly. The streams of a
/// caller with a plan of its own keep them.
const STREAM_M: f32 = 0.05;
const STREAM_M_S: f32 = 0.1;
const STREAM_M_S2: f32 = 0.5;
/// Largest snap in m/s⁴ of a stream.
const STREAM_M_S4: f32 = 400.0;
/// Deceleration in m/s² with which a robot is expected to stop before the fence: less than a third
/// of the planner's limit, because the robot follows 0.2 s late.
const STOP_M_S2: f32 = 1.2;
/// Time in seconds that passes until a robot brakes, with the lag of the acceleration.
const REACTION_S: f32 = 0.25;
/// Deceleration per excess of the speed in 1/s, as in the position loop.
const BRAKE_1_S: f32 = 4.5;
/// Speed per distance outside the fence in 1/s, and largest speed in m/s, of a robot that comes back.
const BACK_1_S: f32 = 1.0;
const BACK_M_S: f32 = 0.5;
/// Height in m by which a robot that leans by 45 degrees stays higher above the least height: the rim of a
/// propeller is 7 cm from its middle, and a robot that swings sinks by some centimeters.
const LEAN_M: f32 = 0.1;
/// Largest tilt of a command in radians.
const TILT_RAD_MAX: f32 = 0.5;
/// Change of the vertical speed of a command in m/s².
const CLIMB_M_S2: f32 = 2.0;

/// The limits of set-points.
#[derive(Clone, Copy, Debug)]
pub(super) struct Governor {
    pub limits: FlightLimits,
    pub fence: PositionFence,
    /// Time of a step in seconds.
    pub dt_s: f32,
}

/// The part of an attitude command that a robot follows at present.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct HeldAttitude {
    /// Horizontal acceleration by the tilt in m/s², in the world.
    pub acceleration_m_s2: Vec2,
    pub climb_m_s: f32,
    pub yaw_rad: f32,
    pub yaw_rate_rad_s: f32,
}

impl HeldAttitude {
    /// Returns the roll and the pitch in radians.
    pub fn tilt_rad(&self) -> Vec2 {
        let (sine, cosine) = libm::sincosf(self.yaw_rad);
        let tilts = Vec2::new(cosine, -sine).rotate(self.acceleration_m_s2 / GRAVITY_M_S2);
        Vec2::new(-libm::atanf(tilts.y), libm::atanf(tilts.x)).clamp_length_max(TILT_RAD_MAX)
    }
}

impl Governor {
    /// Returns the reference one step after `before`, closer to a finite one.
    pub fn reference(&self, before: &Reference, wanted: &Reference) -> Reference {
        let FlightLimits { acceleration_m_s2: acceleration_max, jerk_m_s3: jerk_max, .. } =
            self.limits;
        let dt_s = self.dt_s;
        let place_m = self.fence.clamp(wanted.position_m);
        let gap_m = place_m - before.position_m;
        let [least_m_s, most_m_s] = self.speeds(
            before.position_m,
            before.velocity_m_s,
            before.acceleration_m_s2.truncate(),
        );
        // Far away, the speed from which the robot stops at the place.
        let distance_m = gap_m.length();
        let stopping_m_s = libm::sqrtf(2.0 * STOP_M_S2 * distance_m);
        let closing_m_s = gap_m * CLOSING_1_S.min(stopping_m_s / distance_m.max(1e-6));
        let asked_m_s = shortened(wanted.velocity_m_s, self.limits.speed_m_s);
        let velocity_m_s = self.limits.limit_velocity(asked_m_s + closing_m_s);
        let velocity_m_s = velocity_m_s.max(least_m_s).min(most_m_s);
        let forward_m_s2 = shortened(wanted.acceleration_m_s2, acceleration_max);
        let difference_m_s = velocity_m_s - before.velocity_m_s;
        let acceleration_m_s2 =
            (forward_m_s2 + SPEED_GAIN_1_S * difference_m_s).clamp_length_max(acceleration_max);
        let braked_m_s2 = acceleration_m_s2
            .max(BRAKE_1_S * (least_m_s - before.velocity_m_s))
            .min(BRAKE_1_S * (most_m_s - before.velocity_m_s))
            .clamp_length_max(2.0 * acceleration_max);
        // As in the planner, the acceleration follows with a lag. Its difference is at most twice the
        // limit, so the jerk keeps its limit.
        let lag_1_s = self.limits.lag_rate_s();
        let jerk_m_s3 =
            ((braked_m_s2 - before.acceleration_m_s2) * lag_1_s).clamp_length_max(jerk_max);
        let (yaw_rad, yaw_rate_rad_s) = self.yaw(
            (before.yaw_rad, before.yaw_rate_rad_s),
            wanted.yaw_rate_rad_s + YAW_GAIN_1_S * wrapped(wanted.yaw_rad - before.yaw_rad),
        );
        let is_stream = self.is_stream(before, wanted, [least_m_s, most_m_s]);
        if is_stream {
            return Reference { yaw_rad, yaw_rate_rad_s, ..*wanted };
        }
        let acceleration_m_s2 = before.acceleration_m_s2 + jerk_m_s3 * dt_s;
        let velocity_m_s = before.velocity_m_s + acceleration_m_s2 * dt_s;
        Reference {
            position_m: before.position_m + velocity_m_s * dt_s,
            velocity_m_s,
            acceleration_m_s2,
            jerk_m_s3,
            snap_m_s4: jerk_m_s3 * -lag_1_s,
            yaw_rad,
            yaw_rate_rad_s,
        }
    }

    /// Returns true if a reference continues `before` within the limits, as in the stream of a caller
    /// with a plan of its own.
    fn is_stream(&self, before: &Reference, wanted: &Reference, speeds: [Vec3; 2]) -> bool {
        let [least_m_s, most_m_s] = speeds;
        let is_near = |difference: Vec3, most: f32| difference.length() <= most;
        is_near(wanted.position_m - before.position_m, STREAM_M)
            && is_near(wanted.velocity_m_s - before.velocity_m_s, STREAM_M_S)
            && is_near(wanted.acceleration_m_s2 - before.acceleration_m_s2, STREAM_M_S2)
            && wanted.velocity_m_s == self.limits.limit_velocity(wanted.velocity_m_s)
            && wanted.velocity_m_s.cmpge(least_m_s).all()
            && wanted.velocity_m_s.cmple(most_m_s).all()
            && is_near(wanted.acceleration_m_s2, self.limits.acceleration_m_s2)
            && is_near(wanted.jerk_m_s3, self.limits.jerk_m_s3)
            && is_near(wanted.snap_m_s4, STREAM_M_S4)
            && self.fence.contains(wanted.position_m)
    }

    /// Returns the attitude one step after `before`, closer to a finite command. Without a position,
    /// there is no fence to keep.
    pub fn attitude(
        &self,
        before: &HeldAttitude,
        state: &FlightState,
        wanted: &AttitudeCommand,
        has_position: bool,
    ) -> HeldAttitude {
        let dt_s = self.dt_s;
        let (yaw_rad, yaw_rate_rad_s) =
            self.yaw((before.yaw_rad, before.yaw_rate_rad_s), wanted.yaw_rate_rad_s);
        let climb_max = self.limits.climb_m_s;
        let mut climb_m_s = within(wanted.climb_m_s, -climb_max, climb_max);
        let most_rad = Vec2::splat(TILT_RAD_MAX);
        let tilt_rad = Vec2::new(wanted.roll_rad, wanted.pitch_rad)
            .clamp(-most_rad, most_rad)
            .clamp_length_max(TILT_RAD_MAX);
        let tilts = Vec2::new(libm::tanf(tilt_rad.y), -libm::tanf(tilt_rad.x));
        let (sine, cosine) = libm::sincosf(yaw_rad);
        let mut acceleration_m_s2 = Vec2::new(cosine, sine).rotate(tilts * GRAVITY_M_S2);
        if has_position {
            let lean_m_s2 = before.acceleration_m_s2;
            let [least_m_s, most_m_s] =
                self.speeds(state.position_m, state.velocity_m_s, lean_m_s2);
            climb_m_s = climb_m_s.max(least_m_s.z).min(most_m_s.z);
            let velocity_m_s = state.velocity_m_s.truncate();
            acceleration_m_s2 = acceleration_m_s2
                .max(BRAKE_1_S * (least_m_s.truncate() - velocity_m_s))
                .min(BRAKE_1_S * (most_m_s.truncate() - velocity_m_s));
        }
        let most_m_s2 = GRAVITY_M_S2 * libm::tanf(TILT_RAD_MAX);
        let change_m_s2 = (acceleration_m_s2.clamp_length_max(most_m_s2)
            - before.acceleration_m_s2)
            .clamp_length_max(self.limits.jerk_m_s3 * dt_s);
        let change_m_s = CLIMB_M_S2 * dt_s;
        HeldAttitude {
            acceleration_m_s2: before.acceleration_m_s2 + change_m_s2,
            climb_m_s: within(
                climb_m_s,
                before.climb_m_s - change_m_s,
                before.climb_m_s + change_m_s,
            ),
            yaw_rad,
            yaw_rate_rad_s,
        }
    }

    /// Returns the yaw in rad and its rate in rad/s one step after `before`, for a wanted rate.
    fn yaw(&self, before: (f32, f32), wanted_rad_s: f32) -> (f32, f32) {
        let most_rad_s = self.limits.yaw_rate_rad_s;
        let change_rad_s = self.limits.yaw_acceleration_rad_s2() * self.dt_s;
        let rate_rad_s = within(wanted_rad_s, -most_rad_s, most_rad_s);
        let rate_rad_s = within(rate_rad_s, before.1 - change_rad_s, before.1 + change_rad_s);
        (wrapped(before.0 + rate_rad_s * self.dt_s), rate_rad_s)
    }

    /// Returns the least and the largest velocity along each axis from which the robot stops in the
    /// fence. A robot that leans for a horizontal acceleration stays higher.
    fn speeds(&self, position_m: Vec3, velocity_m_s: Vec3, lean_m_s2: Vec2) -> [Vec3; 2] {
        let position_m = position_m + velocity_m_s * REACTION_S;
        let speed_m_s = self.limits.speed_m_s;
        let limits_m_s = Vec3::new(speed_m_s, speed_m_s, self.limits.climb_m_s);
        let speed = |room_m: f32| {
            // A robot outside comes back.
            let back_m_s = (BACK_1_S * room_m).max(-BACK_M_S);
            if room_m < 0.0 { back_m_s } else { libm::sqrtf(2.0 * STOP_M_S2 * room_m) }
        };
        let speeds = |room_m: Vec3| {
            Vec3::new(speed(room_m.x), speed(room_m.y), speed(room_m.z)).min(limits_m_s)
        };
        let lean_m = LEAN_M * (lean_m_s2.length() / GRAVITY_M_S2).min(1.0);
        let least_m_s = -speeds(position_m - self.fence.least_m() - Vec3::Z * lean_m);
        [least_m_s, speeds(self.fence.most_m() - position_m)]
    }
}

/// Returns the number within two limits. Unlike `clamp`, it cannot panic.
fn within(number: f32, least: f32, most: f32) -> f32 {
    number.max(least).min(most)
}

/// Returns a finite vector, shortened to this length. The square of a large one overflows, so each
/// component is limited first.
fn shortened(vector: Vec3, most: f32) -> Vec3 {
    vector.clamp(Vec3::splat(-most), Vec3::splat(most)).clamp_length_max(most)
}
