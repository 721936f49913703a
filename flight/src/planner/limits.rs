//! Limits of the motion that a planner asks for.

use glam::Vec3;

/// Share by which rounding may exceed a limit.
const ROUNDING: f32 = 1.001;

/// The fastest motion of a reference. All numbers are finite and more than 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlightLimits {
    /// Horizontal speed in m/s.
    pub speed_m_s: f32,
    /// Vertical speed in m/s, upwards or downwards.
    pub climb_m_s: f32,
    /// Magnitude of the acceleration in m/s².
    pub acceleration_m_s2: f32,
    /// Magnitude of the jerk in m/s³.
    pub jerk_m_s3: f32,
    /// Rate of yaw in rad/s. It changes by at most this rate times `jerk_m_s3 / acceleration_m_s2`
    /// per second.
    pub yaw_rate_rad_s: f32,
}

impl FlightLimits {
    /// Limits that suit a Crazyflie indoors.
    ///
    /// The acceleration needs a tilt of 22 degrees, or 1.41 times the weight as thrust if it points
    /// upwards; a Crazyflie 2.1+ has 1.54 times its weight (`Vehicle::CRAZYFLIE_2_1_PLUS`).
    pub const CRAZYFLIE: Self = FlightLimits {
        speed_m_s: 1.5,
        climb_m_s: 0.7,
        acceleration_m_s2: 4.0,
        jerk_m_s3: 40.0,
        yaw_rate_rad_s: 2.0,
    };

    /// Returns true if every limit is finite and more than 0.
    pub fn are_valid(&self) -> bool {
        [
            self.speed_m_s,
            self.climb_m_s,
            self.acceleration_m_s2,
            self.jerk_m_s3,
            self.yaw_rate_rad_s,
        ]
        .iter()
        .all(|limit| limit.is_finite() && *limit > 0.0)
    }

    /// Returns these limits with at most this acceleration in m/s². The jerk falls by the same share, so
    /// that a lag of the velocity stays the same.
    pub(super) fn with_acceleration(&self, most_m_s2: f32) -> Self {
        let share = (most_m_s2 / self.acceleration_m_s2).min(1.0);
        FlightLimits {
            acceleration_m_s2: self.acceleration_m_s2 * share,
            jerk_m_s3: self.jerk_m_s3 * share,
            ..*self
        }
    }

    /// Returns true if the horizontal and the vertical speed are allowed.
    pub(super) fn allow_velocity(&self, velocity_m_s: Vec3) -> bool {
        velocity_m_s.truncate().length() <= self.speed_m_s * ROUNDING
            && libm::fabsf(velocity_m_s.z) <= self.climb_m_s * ROUNDING
    }

    /// Returns true if the acceleration is allowed.
    pub(super) fn allow_acceleration(&self, acceleration_m_s2: Vec3) -> bool {
        acceleration_m_s2.length() <= self.acceleration_m_s2 * ROUNDING
    }

    /// Returns true if the jerk is allowed.
    pub(super) fn allow_jerk(&self, jerk_m_s3: Vec3) -> bool {
        jerk_m_s3.length() <= self.jerk_m_s3 * ROUNDING
    }

    /// Returns true if the rate of yaw is allowed.
    pub(super) fn allow_yaw_rate(&self, yaw_rate_rad_s: f32) -> bool {
        libm::fabsf(yaw_rate_rad_s) <= self.yaw_rate_rad_s * ROUNDING
    }

    /// Returns true if the acceleration of the yaw is allowed.
    pub(super) fn allow_yaw_acceleration(&self, yaw_acceleration_rad_s2: f32) -> bool {
        libm::fabsf(yaw_acceleration_rad_s2) <= self.yaw_acceleration_rad_s2() * ROUNDING
    }

    /// Returns the largest acceleration of the yaw in rad/s², which a lag needs to reverse the
    /// largest rate.
    pub(crate) fn yaw_acceleration_rad_s2(&self) -> f32 {
        2.0 * self.yaw_rate_rad_s * self.lag_rate_s()
    }

    /// Returns the velocity with its horizontal part shortened, and its vertical part limited.
    pub(crate) fn limit_velocity(&self, velocity_m_s: Vec3) -> Vec3 {
        velocity_m_s
            .truncate()
            .clamp_length_max(self.speed_m_s)
            .extend(velocity_m_s.z.max(-self.climb_m_s).min(self.climb_m_s))
    }

    /// Returns the rate at which a velocity follows its lead, in 1/s.
    ///
    /// The lead changes by at most the acceleration A per second, so the velocity does too. Its
    /// jerk is the rate times the difference of both accelerations, which is at most 2 A.
    pub(crate) fn lag_rate_s(&self) -> f32 {
        self.jerk_m_s3 / (2.0 * self.acceleration_m_s2)
    }
}
