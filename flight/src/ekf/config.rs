//! Parameters of the Kalman filter.

use glam::Vec3;

/// Spectral densities of the white noise that the model does not explain.
///
/// A density times the square root of the elapsed seconds is a standard deviation. Filters that
/// instead add a standard deviation s in each step of t seconds have the density s/√t; for example
/// 0.1 rad/s · 1 ms in each millisecond is 0.003 16 rad/√s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EkfNoise {
    /// Specific force along body x and y that neither thrust nor drag explains, in m/s²/√Hz.
    pub accel_xy: f32,
    /// Noise of the accelerometer along body z, in m/s²/√Hz.
    pub accel_z: f32,
    /// Random walk of the position, in m/√s.
    pub position: f32,
    /// Random walk of the attitude about each body axis, in rad/√s.
    pub attitude: f32,
    /// Noise of the gyroscope, in rad/s/√Hz. In contrast to [`attitude`](Self::attitude) it also
    /// turns the velocity, which is in the body frame.
    pub gyro: f32,
    /// Random walk of the gyroscope's bias, in rad/s/√s.
    pub gyro_bias: f32,
    /// Random walk of the accelerometer's bias, in m/s²/√s.
    pub accel_bias: f32,
}

impl EkfNoise {
    /// Noise of a small quadrotor in flight.
    ///
    /// The forces along x and y stand for turbulence and for the drag that the model omits. The
    /// noise of the gyroscope is ten times that of the sensor at rest, because propellers shake it.
    pub const QUADROTOR: Self = EkfNoise {
        accel_xy: 0.05,
        accel_z: 0.05,
        position: 0.0,
        attitude: 0.0,
        gyro: 0.003,
        gyro_bias: 2e-4,
        accel_bias: 5e-3,
    };

    /// Noise of the filter with nine states in the literature and in autopilots of small
    /// quadrotors: 0.5 m/s² along x and y, 1 m/s² along z and 0.1 rad/s, added every millisecond,
    /// and no noise of the biases.
    pub const NINE_STATES: Self = EkfNoise {
        accel_xy: 0.5 * SQRT_MILLISECOND,
        accel_z: SQRT_MILLISECOND,
        position: 0.0,
        attitude: 0.1 * SQRT_MILLISECOND,
        gyro: 0.0,
        gyro_bias: 0.0,
        accel_bias: 0.0,
    };
}

/// √0.001 s.
const SQRT_MILLISECOND: f32 = 0.031_622_776;

/// Standard deviations of the state after a reset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EkfSigma {
    /// Position along world x and y, in m.
    pub position_xy_m: f32,
    /// Position along world z, in m.
    pub position_z_m: f32,
    /// Velocity along each body axis, in m/s.
    pub velocity_m_s: f32,
    /// Attitude about body x and y, in rad.
    pub tilt_rad: f32,
    /// Attitude about body z, in rad.
    pub yaw_rad: f32,
    /// Bias of each axis of the gyroscope, in rad/s.
    pub gyro_bias_rad_s: f32,
    /// Bias of the accelerometer along body z, in m/s².
    pub accel_bias_m_s2: f32,
}

/// The form of the matrix that carries the error over one prediction.
///
/// With θ the angle of the body's turn in the prediction, the error of the attitude in the body
/// frame turns by −θ (Markley 2003, equation 24).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Linearization {
    /// Errors of attitude and velocity turn by the whole angle, to the second order in θ.
    WholeAngle,
    /// The error of the attitude turns by θ/2 to the second order, the velocity and its error by θ
    /// to the first order, and all noise acts after the prediction, as in common implementations of
    /// the filter with nine states. This form exists to compare with them: a yaw of 90 degrees turns
    /// the error of the tilt by 45 degrees.
    HalfAngle,
}

/// Parameters of the Kalman filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EkfConfig {
    /// Process noise.
    pub noise: EkfNoise,
    /// Standard deviations after a reset. Position is limited to 10 m, the root of the cap.
    pub initial_sigma: EkfSigma,
    /// Linear drag along each body axis in flight, in 1/s: force / (mass · velocity). The
    /// accelerometer already measures the drag along z, so z stays 0 in normal use.
    pub drag_per_s: Vec3,
    /// Least variance of position (m²), velocity (m²/s²) and attitude error (rad²). Biases have no
    /// floor, so that a variance of 0 turns the estimation of a bias off.
    pub variance_floor: f32,
    /// Form of the matrix that carries the error over one prediction.
    pub linearization: Linearization,
    /// Acceleration in m/s² along body x and y from which the accelerometer shows an outer force, such
    /// as wind, that thrust and drag do not explain. Below it the offset of the sensor (0.2 m/s² for
    /// the BMI088) and vibration are as large. Infinite for a filter that knows no outer force.
    pub least_outer_m_s2: f32,
    /// True if the filter estimates by how much poses are older than it assumes.
    pub estimates_pose_age: bool,
    /// True if flow corrects x and y in the world, as the optimal gain does.
    ///
    /// The optimal position is then the sum of all counts with their noise, a walk that no robot can
    /// follow (20 mm in the first second with 2 counts at 0.5 m). If false, x and y follow only the
    /// estimated velocity, which is smooth; the drift is that of the sum plus the delay of the
    /// velocity. The covariance accounts for this.
    pub flow_moves_position: bool,
}

impl EkfConfig {
    /// Parameters of a small quadrotor whose inertial sensors were calibrated at rest.
    ///
    /// The floor is 0.1 mm, 0.1 mm/s and 0.1 mrad: far below what sensors can justify, far above
    /// the resolution of f32 at the cap of 100 m² once the second pass of the update has run.
    pub const QUADROTOR: Self = EkfConfig {
        noise: EkfNoise::QUADROTOR,
        initial_sigma: EkfSigma {
            position_xy_m: 10.0,
            position_z_m: 1.0,
            velocity_m_s: 0.05,
            tilt_rad: 0.02,
            yaw_rad: 0.05,
            gyro_bias_rad_s: 0.005,
            accel_bias_m_s2: 0.1,
        },
        drag_per_s: Vec3::ZERO,
        variance_floor: 1e-8,
        linearization: Linearization::WholeAngle,
        least_outer_m_s2: 0.4,
        estimates_pose_age: true,
        flow_moves_position: false,
    };

    /// The filter with nine states: no bias is estimated.
    pub const NINE_STATES: Self = EkfConfig {
        noise: EkfNoise::NINE_STATES,
        initial_sigma: EkfSigma {
            position_xy_m: 10.0,
            position_z_m: 1.0,
            velocity_m_s: 0.01,
            tilt_rad: 0.01,
            yaw_rad: 0.01,
            gyro_bias_rad_s: 0.0,
            accel_bias_m_s2: 0.0,
        },
        drag_per_s: Vec3::ZERO,
        variance_floor: 1e-6,
        linearization: Linearization::HalfAngle,
        least_outer_m_s2: f32::INFINITY,
        estimates_pose_age: false,
        flow_moves_position: true,
    };
}

impl Default for EkfConfig {
    fn default() -> Self {
        Self::QUADROTOR
    }
}
