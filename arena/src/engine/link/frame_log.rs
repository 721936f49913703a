//! Frames in the form for observers of the world. The world records them only while it is watched.

use super::Medium;
use super::air::Transmissions;
use super::packet::{Packet, Transmission};
use crate::engine::TICK_US;
use crate::engine::id::RobotId;

/// A frame that was sent. The sender and the start time identify it, because a robot sends one
/// frame at a time.
#[derive(Clone, Debug)]
pub struct SentFrame {
    pub sender: RobotId,
    /// The start time in µs since the world began.
    pub start_us: u64,
    pub medium: Medium,
    packet: Packet,
}

impl SentFrame {
    /// Returns the frame of a transmission. `start_us` is its start time since the world began.
    pub(crate) fn new(
        medium: Medium,
        transmission: &Transmission,
        packet: Packet,
        start_us: u64,
    ) -> Self {
        SentFrame { sender: transmission.from, start_us, medium, packet }
    }

    /// Returns the frame of the transmission at an index, which robots receive in tick `now`.
    pub(crate) fn received_at(now: u64, air: &Transmissions, index: u32) -> Self {
        let transmission = &air.transmissions()[index as usize];
        // Start times of transmissions count from the beginning of the tick before.
        let window_us = now.saturating_sub(1) * u64::from(TICK_US);
        let start_us = window_us.saturating_add_signed(transmission.start.into());
        SentFrame::new(air.medium, transmission, Packet::copied(air.frame(index)), start_us)
    }

    /// Returns the type byte and payload; on infrared always 10 bytes.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        self.packet.bytes()
    }
}

/// A reason why a frame within reach of a robot does not get to its script.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum LossCause {
    /// The robot was sending at the same time.
    Sending,
    /// The frame overlapped with another one at the robot.
    Collision,
    /// The link lost the frame by chance.
    Chance,
    /// A blocked link, a partition, or a wall on infrared separates the sender and the robot.
    CutOff,
    /// The robot is stopped or has failed.
    Off,
    /// The frame arrived, but the robot's queue of frames was full. The queue may have discarded
    /// another frame to take this one.
    QueueFull,
    /// The frame arrived, but it is longer than the frames of the robot's machine or has no known
    /// type.
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

/// The fate of a frame at a robot within its reach.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fate {
    /// The frame arrived.
    Received {
        /// True if the frame arrived twice (an option for tests).
        is_duplicated: bool,
        /// The tick until which the link holds the frame back (an option for tests). A robot that
        /// is switched off before that tick never receives it.
        held_until: Option<u64>,
    },
    Lost(LossCause),
}

/// The arrival or loss of a frame at a robot within its reach.
#[derive(Clone, Debug)]
pub struct Arrival {
    pub frame: SentFrame,
    pub receiver: RobotId,
    pub fate: Fate,
}

/// A robot's attempt to send.
#[derive(Clone, Debug)]
pub enum SendAttempt {
    /// The frame is on the air.
    Sent(SentFrame),
    /// The channel was busy: the robot tries again later.
    Postponed {
        sender: RobotId,
        /// The time of the attempt, in µs since the world began.
        at_us: u64,
        /// The number of frames that the robot sensed.
        sensed: usize,
    },
}

/// The frames of one tick.
#[derive(Clone, Debug, Default)]
pub struct FrameLog {
    /// The frames that ended in the last tick, ordered by receiver.
    pub arrivals: Vec<Arrival>,
    /// The attempts to send in this tick, in chronological order on each medium.
    pub attempts: Vec<SendAttempt>,
}
