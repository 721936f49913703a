//! Parameters of the flight controller.

use glam::Vec3;

use crate::Vehicle;
use crate::ekf::{EkfConfig, EkfSigma};
use crate::geometric::GeometricSettings;
use crate::planner::{FlightLimits, PositionFence};
use crate::supervisor::SupervisorLimits;

/// Drag of the Crazyflie 2.1+ in 1/s, which the controller feeds forward.
const DRAG_1_S: Vec3 = GeometricSettings::CRAZYFLIE_2_1_PLUS.drag_1_s;
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
    /// A Crazyflie 2.1+ without a fence, which knows its start to some centimetres.
    ///
    /// A robot that stands elsewhere adopts the place that its poses agree on.
    pub const CRAZYFLIE_2_1_PLUS: Self = StackSettings {
        vehicle: Vehicle::CRAZYFLIE_2_1_PLUS,
        gains: GeometricSettings::CRAZYFLIE_2_1_PLUS,
        filter: EkfConfig {
            initial_sigma: EkfSigma {
                position_xy_m: START_SIGMA_M,
                position_z_m: START_SIGMA_M,
                ..EkfConfig::QUADROTOR.initial_sigma
            },
            drag_per_s: Vec3::new(DRAG_1_S.x, DRAG_1_S.y, 0.0),
            ..EkfConfig::QUADROTOR
        },
        limits: FlightLimits::CRAZYFLIE,
        fence: PositionFence::WIDE,
        supervision: SupervisorLimits::CRAZYFLIE_2_1_PLUS,
    };
}
