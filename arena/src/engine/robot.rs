//! One robot: who it is and what others may see of it.

use super::body::Body;
use super::geometry::Pose;
use super::link::{Medium, Radio};
use super::variant::Variant;

/// Number of a robot: its place in the order of joining, and its id in frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct RobotId(pub u16);

/// What a robot is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum RobotKind {
    /// Vibration motors, infrared.
    Kilobot,
    /// Wheels, nRF24 radio, projector.
    Zooid,
    /// Flies; nRF51 radio.
    Crazyflie,
}

impl RobotKind {
    /// By what it talks.
    #[must_use]
    pub fn medium(self) -> Medium {
        match self {
            RobotKind::Kilobot => Medium::Infrared,
            RobotKind::Zooid => Medium::Nrf24,
            RobotKind::Crazyflie => Medium::P2p,
        }
    }
}

/// Whether a robot works.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum RobotState {
    /// Its brain runs.
    Running,
    /// Stopped: no motors, no link, no brain, until it is resumed.
    Stopped,
    /// Failed, until it is restarted. Its body stays where it is.
    Failed,
}

/// What can be seen of a robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// What it is.
    pub kind: RobotKind,
    /// Whether it works.
    pub state: RobotState,
    /// Where it is.
    pub pose: Pose,
    /// Where it believes to be, if it knows.
    pub estimate: Option<Pose>,
    /// mm
    pub radius: f32,
    /// Colour: the sum of 1 red, 2 green, 4 blue.
    pub led: u8,
}

/// A robot, but for its brain and where it is.
#[derive(Clone, Debug)]
pub(crate) struct Robot {
    pub(crate) variant: Variant,
    pub(crate) body: Body,
    pub(crate) radio: Radio,
    pub(crate) state: RobotState,
    pub(crate) led: u8,
}
