//! One robot: its identity and its visible state.

use super::geometry::Pose;
use super::herd::HerdId;
use super::link::RobotRadio;

/// The state of a robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum RobotState {
    /// The brain runs.
    Running,
    /// Stopped until it is resumed: motors, link and brain are off.
    Stopped,
    /// Failed or crashed, until the robot is restarted. Its body stays where it is; one in the air
    /// falls.
    Failed,
}

/// The visible state of a robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RobotView {
    /// The robot's herd.
    pub herd: HerdId,
    pub state: RobotState,
    /// The true pose.
    pub pose: Pose,
    /// The robot's estimate of its pose, if it has one.
    pub estimate: Option<Pose>,
    /// Radius in mm.
    pub radius_mm: f32,
    /// Height in mm.
    pub height_mm: f32,
    /// Color: the sum of 1 red, 2 green, 4 blue.
    pub led: u8,
    /// The number of crashes since the world began.
    pub crashes: u32,
}

/// The data of a robot, except its brain, its body and its place, which the world keeps in other
/// lists.
#[derive(Clone, Debug)]
pub(crate) struct EngineRobot {
    pub(crate) herd: HerdId,
    /// Index of the robot's cohort.
    pub(crate) cohort: u32,
    pub(crate) radio: RobotRadio,
    pub(crate) state: RobotState,
    pub(crate) led: u8,
    pub(crate) crashes: u32,
}
