//! Parameters of the flight controller.

use glam::Vec3;

use crate::Vehicle;
use crate::ekf::{EkfConfig, EkfSigma};
use crate::geometric::GeometricSettings;
use crate::planner::{FlightLimits, PositionFence};
use crate::supervisor::SupervisorLimits;

/// Standard deviation in m of the place where a robot is put.
const START_SIGMA_M: f32 = 0.02;

/// Parameters of the flight controller.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StackSettings {
    /// The robot.
    pub vehicle: Vehicle,
    /// Gains of the controller.
    pub gains: GeometricSettings,
    /// Parameters of the filter.
    pub filter: EkfConfig,
    /// Limits of planned motion.
    pub limits: FlightLimits,
    /// The box that planned motion does not leave.
    pub fence: PositionFence,
    /// Limits of the supervisor.
    pub supervision: SupervisorLimits,
}

impl StackSettings {
    /// A Crazyflie 2.1+ without a fence, which knows its start to some centimeters.
    ///
    /// A robot that stands elsewhere adopts the place that its poses agree on.
    pub const CRAZYFLIE_2_1_PLUS: Self = Self::new(
        Vehicle::CRAZYFLIE_2_1_PLUS,
        GeometricSettings::CRAZYFLIE_2_1_PLUS,
        SupervisorLimits::CRAZYFLIE_2_1_PLUS,
    );

    /// A Crazyflie 2.1 Brushless, as [`StackSettings::CRAZYFLIE_2_1_PLUS`].
    pub const CRAZYFLIE_BRUSHLESS: Self = Self::new(
        Vehicle::CRAZYFLIE_BRUSHLESS,
        GeometricSettings::CRAZYFLIE_BRUSHLESS,
        SupervisorLimits::CRAZYFLIE_BRUSHLESS,
    );

    const fn new(
        vehicle: Vehicle,
        gains: GeometricSettings,
        supervision: SupervisorLimits,
    ) -> Self {
        let filter = EkfConfig {
            initial_sigma: EkfSigma {
                position_xy_m: START_SIGMA_M,
                position_z_m: START_SIGMA_M,
                ..EkfConfig::QUADROTOR.initial_sigma
            },
            // The controller feeds the same drag forward.
            drag_per_s: Vec3::new(gains.drag_1_s.x, gains.drag_1_s.y, 0.0),
            ..EkfConfig::QUADROTOR
        };
        let (limits, fence) = (FlightLimits::CRAZYFLIE, PositionFence::WIDE);
        StackSettings { vehicle, gains, filter, limits, fence, supervision }
    }
}
