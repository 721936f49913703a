//! Frames that reached a robot.

use super::frame_log::SentFrame;
use super::packet::FrameSighting;

/// A frame that a robot received in this tick.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DeliveredFrame {
    pub(crate) transmission: u32,
    pub(crate) sighting: FrameSighting,
}

/// A frame that was held back on its way (an option for tests).
#[derive(Clone, Debug)]
pub(crate) struct Late {
    pub(crate) due: u64,
    pub(crate) frame: SentFrame,
    pub(crate) sighting: FrameSighting,
}
