//! One robot: who it is and what others may see of it.

use super::geometry::Pose;
use super::herd::HerdId;
use super::link::Radio;

/// Whether a robot works.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum RobotState {
    /// Its brain runs.
    Running,
    /// Stopped: no motors, no link, no brain, until it is resumed.
    Stopped,
    /// Failed or crashed, until it is restarted. Its body stays where it is; one in the air falls.
    Failed,
}

/// What can be seen of a robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// The herd to which it belongs.
    pub herd: HerdId,
    /// Whether it works.
    pub state: RobotState,
    /// Where it is.
    pub pose: Pose,
    /// Where it believes to be, if it knows.
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
pub(crate) struct Robot {
    pub(crate) herd: HerdId,
    /// The number of its cohort.
    pub(crate) cohort: u32,
    pub(crate) radio: Radio,
    pub(crate) state: RobotState,
    pub(crate) led: u8,
    pub(crate) crashes: u32,
}
