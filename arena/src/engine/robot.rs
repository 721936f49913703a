//! One robot: its identity, and the state that others may see.

use super::geometry::Pose;
use super::herd::HerdId;
use super::link::Radio;

/// The state of a robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum RobotState {
    /// Its brain runs.
    Running,
    /// Stopped: no motors, no link, no brain, until it is resumed.
    Stopped,
    /// Failed or crashed, until it is restarted. Its body stays where it is; one in the air falls.
    Failed,
}

/// The visible state of a robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// The herd to which it belongs.
    pub herd: HerdId,
    /// Its state.
    pub state: RobotState,
    /// Its pose.
    pub pose: Pose,
    /// The robot's estimate of its pose, if it has one.
    pub estimate: Option<Pose>,
    /// mm
    pub radius: f32,
    /// mm
    pub height: f32,
    /// Colour: the sum of 1 red, 2 green, 4 blue.
    pub led: u8,
    /// Its crashes since the world began.
    pub crashes: u32,
}

/// A robot, but for its brain, its body and its place.
#[derive(Clone, Debug)]
pub(crate) struct EngineRobot {
    pub(crate) herd: HerdId,
    /// The number of its cohort.
    pub(crate) cohort: u32,
    pub(crate) radio: Radio,
    pub(crate) state: RobotState,
    pub(crate) led: u8,
    pub(crate) crashes: u32,
}
