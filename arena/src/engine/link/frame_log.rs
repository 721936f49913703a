//! Frames as an observer of the world sees them. The world notes them only while it is watched.

use super::Medium;
use super::packet::{Packet, Transmission};
use crate::engine::TICK_US;
use crate::engine::id::RobotId;

/// A frame that was on the air. Its sender and its beginning name it, because a robot sends one frame at a time.
#[derive(Clone, Debug)]
pub struct SentFrame {
    /// The robot that sent it.
    pub sender: RobotId,
    /// The time at which it began, in µs since the world began.
    pub start_us: u64,
    /// The medium that carried it.
    pub medium: Medium,
    packet: Packet,
}

impl SentFrame {
    /// Returns the frame of a transmission. `start_us` is its beginning since the world began.
    pub(crate) fn new(medium: Medium, transmission: &Transmission, start_us: u64) -> Self {
        let Transmission { from, packet, .. } = *transmission;
        SentFrame { sender: from, start_us, medium, packet }
    }

    /// Returns the frame of a transmission that robots hear in tick `now`.
    pub(crate) fn heard_at(now: u64, medium: Medium, transmission: &Transmission) -> Self {
        // Transmissions count from the beginning of the tick before.
        let window_us = now.saturating_sub(1) * u64::from(TICK_US);
        let start_us = window_us.saturating_add_signed(transmission.start.into());
        SentFrame::new(medium, transmission, start_us)
    }

    /// Returns its type byte and payload; on infrared always 10 bytes.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        self.packet.bytes()
    }
}

/// A reason why a frame in reach of a robot does not get to its script.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum LossCause {
    /// The robot was sending meanwhile.
    Sending,
    /// The frame overlapped with another one at the robot.
    Collision,
    /// The link lost it by chance.
    Chance,
    /// A blocked link or a partition is between sender and robot.
    CutOff,
    /// The robot is stopped or has failed.
    Off,
    /// It arrived, and the robot's queue of frames was full. The queue may have discarded another frame to take this one.
    QueueFull,
    /// It arrived, and is longer than the frames of the robot's machine, or has no known type.
    Unreadable,
}

impl LossCause {
    /// All causes.
    pub const ALL: [LossCause; 7] = [
        LossCause::Sending,
        LossCause::Collision,
        LossCause::Chance,
        LossCause::CutOff,
        LossCause::Off,
        LossCause::QueueFull,
        LossCause::Unreadable,
    ];
}

/// The fate of a frame at a robot in its reach.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fate {
    /// It arrived.
    Heard {
        /// It arrived twice (an option for tests).
        is_duplicated: bool,
        /// The link holds it back until that tick (an option for tests). A robot that is switched off before never hears it.
        held_until: Option<u64>,
    },
    /// It was lost.
    Lost(LossCause),
}

/// A frame at a robot in its reach.
#[derive(Clone, Debug)]
pub struct Arrival {
    /// The frame.
    pub frame: SentFrame,
    /// The robot.
    pub receiver: RobotId,
    /// The frame's fate.
    pub fate: Fate,
}

/// A robot's attempt to send.
#[derive(Clone, Debug)]
pub enum SendAttempt {
    /// The frame is on the air.
    Sent(SentFrame),
    /// The channel was busy: the robot tries again later.
    Postponed {
        /// The robot.
        sender: RobotId,
        /// The time of the attempt, in µs since the world began.
        at_us: u64,
        /// The number of frames that it sensed.
        sensed: usize,
    },
}

/// The frames of one tick.
#[derive(Clone, Debug, Default)]
pub struct FrameLog {
    /// Frames that ended in the tick before, by receiver.
    pub arrivals: Vec<Arrival>,
    /// Attempts to send in this tick, in the order of time on each medium.
    pub attempts: Vec<SendAttempt>,
}
