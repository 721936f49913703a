//! Values that the parts of a flight controller exchange.

use glam::{Quat, Vec3};

/// One sample of the inertial sensors, calibrated, in the body frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ImuSample {
    /// Angular rate in rad/s.
    pub gyro_rad_s: Vec3,
    /// Specific force in m/s².
    pub accel_m_s2: Vec3,
}

/// The motion of a robot at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlightState {
    /// Position in the world frame, in m.
    pub position_m: Vec3,
    /// Velocity in the world frame, in m/s.
    pub velocity_m_s: Vec3,
    /// Rotation from the body frame to the world frame.
    pub attitude: Quat,
    /// Angular rate in the body frame, in rad/s.
    pub rate_rad_s: Vec3,
}

impl Default for FlightState {
    fn default() -> Self {
        FlightState {
            position_m: Vec3::ZERO,
            velocity_m_s: Vec3::ZERO,
            attitude: Quat::IDENTITY,
            rate_rad_s: Vec3::ZERO,
        }
    }
}

/// A point of a planned path in the world frame, with the derivatives that a controller feeds
/// forward.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reference {
    /// Position in m.
    pub position_m: Vec3,
    /// Velocity in m/s.
    pub velocity_m_s: Vec3,
    /// Acceleration in m/s², without gravity.
    pub acceleration_m_s2: Vec3,
    /// Jerk in m/s³.
    pub jerk_m_s3: Vec3,
    /// Snap in m/s⁴.
    pub snap_m_s4: Vec3,
    /// Yaw in radians.
    pub yaw_rad: f32,
    /// Rate of yaw in rad/s.
    pub yaw_rate_rad_s: f32,
}

/// Thrust and torque that all motors exert together, in the body frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Wrench {
    /// Thrust along z in N.
    pub thrust_n: f32,
    /// Torque about x, y and z in N·m.
    pub torque_n_m: Vec3,
}

/// The thrust of each motor in N, 0 or more.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MotorForces(pub [f32; 4]);

/// The share of the battery's voltage that each motor receives, 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MotorDuties(pub [f32; 4]);
