//! The motion of a robot.

use glam::{DQuat, DVec3};

/// The motion of a robot at the end of a step.
///
/// The world frame has x and y on the ground and z upwards; the body frame has x ahead, y to the
/// left and z upwards. Motor 1 is ahead on the right, the others follow clockwise seen from above.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DroneState {
    /// Steps of a millisecond since the start.
    pub steps: u64,
    /// Position of the center of mass in the world frame, in m.
    pub position_m: DVec3,
    /// Velocity in the world frame, in m/s.
    pub velocity_m_s: DVec3,
    /// Rotation from the body frame to the world frame.
    pub attitude: DQuat,
    /// Angular rate in the body frame, in rad/s.
    pub rate_rad_s: DVec3,
    /// Speed of each rotor in rpm, 0 or more.
    pub rotor_rpm: [f64; 4],
    /// Mean specific force of the last step at the center of mass, in the body frame, in m/s². It
    /// includes the forces of contact.
    pub specific_force_m_s2: DVec3,
}

impl DroneState {
    /// Returns the state of a robot that stands still at this position.
    ///
    /// # Parameters
    /// `yaw_rad`: direction of the robot's x axis, anticlockwise from the world's x axis.
    #[must_use]
    pub fn at_rest(position_m: DVec3, yaw_rad: f64) -> Self {
        DroneState {
            steps: 0,
            position_m,
            velocity_m_s: DVec3::ZERO,
            attitude: DQuat::from_xyzw(
                0.0,
                0.0,
                libm::sin(yaw_rad / 2.0),
                libm::cos(yaw_rad / 2.0),
            ),
            rate_rad_s: DVec3::ZERO,
            rotor_rpm: [0.0; 4],
            specific_force_m_s2: DVec3::new(0.0, 0.0, crate::GRAVITY_M_S2),
        }
    }

    /// Returns the time since the start in seconds.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        self.steps as f64 * crate::STEP_S
    }

    /// Returns the cosine of the angle between the body's z axis and the vertical.
    #[must_use]
    pub fn cos_tilt(&self) -> f64 {
        let DQuat { x, y, .. } = self.attitude;
        1.0 - 2.0 * (x * x + y * y)
    }

    /// Returns the angle between the body's z axis and the vertical in radians, 0 to π.
    #[must_use]
    pub fn tilt_rad(&self) -> f64 {
        libm::acos(self.cos_tilt().clamp(-1.0, 1.0))
    }

    /// Returns the velocity in the body frame, in m/s.
    #[must_use]
    pub fn body_velocity_m_s(&self) -> DVec3 {
        self.attitude.conjugate() * self.velocity_m_s
    }
}
