//! The interface through which a board handles commands.

use std::ops::RangeInclusive;

use bittybuzz_chips::devices::{eeprom_24aa64, one_wire};
use bittybuzz_chips::f405::OTP;
use bittybuzz_chips::{Board, FRAME_PAYLOAD_MAX, MemoryContent, P2P_MAX};

use crate::message::{self, BoardStatistics, Command};

/// A board that handles commands about its robot and the robot's surroundings.
pub trait Control: Board {
    /// The robot's name in messages to users.
    const NAME: &'static str;

    /// Handles a command that concerns the board.
    fn execute(&mut self, command: Command) -> Result<(), CommandRefusal>;

    /// Returns the board's counters since power-on.
    fn counted(&self) -> BoardStatistics;
}

/// A reason why a board refuses a command.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CommandRefusal {
    /// The payload is too long for a frame of the link.
    #[error("a frame's payload has at most {FRAME_PAYLOAD_MAX} bytes, this one has {0}")]
    FrameTooLong(usize),
    /// The payload is too long for a P2P frame.
    #[error("a P2P frame has at most {P2P_MAX} bytes, this one has {0}")]
    P2pTooLong(usize),
    /// The content is too long for the memory of a deck.
    #[error("the memory of a deck has at most {max} bytes, this one has {0}", max = one_wire::CAPACITY)]
    DeckMemory(usize),
    /// The content is too long for the EEPROM.
    #[error("the EEPROM has {max} bytes, not {0}", max = eeprom_24aa64::CAPACITY)]
    Eeprom(usize),
    /// The probability is not between 0 and 1.
    #[error("a probability is between 0 and 1, not {0}")]
    NotAProbability(f64),
    /// The number is infinite or not a number.
    #[error("{name} is a finite number, not {value}")]
    NotFinite {
        /// The field of the command.
        name: &'static str,
        /// The refused value.
        value: f64,
    },
    /// The number is out of range.
    #[error("{name} is between {} and {}, not {value}", .range.start(), .range.end())]
    OutOfRange {
        /// The field of the command.
        name: &'static str,
        /// The range.
        range: RangeInclusive<f64>,
        /// The refused value.
        value: f64,
    },
    /// The command is about a sensor of a deck that is not attached.
    #[error(
        "no Flow deck is attached: send {{\"command\":\"decks\",\"decks\":[\"flow_v2\"]}} first"
    )]
    NoFlowDeck,
    /// The command is about a body that the robot does not have.
    #[error("the robot has no body: send {{\"command\":\"body\",\"seed\":1}} first")]
    NoBody,
    /// The jitter of edges is out of range.
    #[error("jitter_us is between 0 and {most}, not {value}")]
    Jitter {
        /// The highest value.
        most: f64,
        /// The refused value.
        value: f64,
    },
    /// The number of glitches per second is out of range.
    #[error("glitches_per_s is between 0 and {most}, not {value}")]
    Glitches {
        /// The highest value.
        most: f64,
        /// The refused value.
        value: f64,
    },
    /// The error of the oscillator is out of range.
    #[error("error_ppm is between -{most} and {most}, not {value}")]
    ClockError {
        /// The highest magnitude.
        most: f64,
        /// The refused value.
        value: f64,
    },
    /// The frequency is outside the oscillator's range in the data sheet.
    #[error("lsi_hz is between {} and {}, not {hz}", .range.start(), .range.end())]
    Lsi {
        /// The range in the data sheet.
        range: RangeInclusive<u64>,
        /// The refused value.
        hz: u64,
    },
    /// There are more bytes than the one-time programmable memory has.
    #[error("a Crazyflie has {OTP} one-time programmable bytes, not {0}")]
    Otp(usize),
    /// The threshold of RTS is out of range: above it, the bytes that are already under way do not
    /// fit into the FIFO.
    #[error("rts_bytes is between 1 and {most}, not {value}")]
    RtsBytes {
        /// The highest value.
        most: u8,
        /// The refused value.
        value: u8,
    },
    /// Bluetooth's shutdown takes longer than the limit.
    #[error("ble_shutdown_us is at most 1000000, not {0}")]
    BleShutdown(u64),
    /// The length is not that of a Kilobot's frame.
    #[error(
        "a Kilobot's frame is 9 bytes of data and its type, and 2 of its checksum or none: 10 or 12, not {0}"
    )]
    Infrared(usize),
    /// The command is for another kind of robot.
    #[error(
        "a {0} does not handle this command; docs/emulation.md lists the commands of each robot"
    )]
    OtherRobot(&'static str),
}

/// Returns `value` if it is a probability.
pub fn probability(value: f64) -> Result<f64, CommandRefusal> {
    if (0.0..=1.0).contains(&value) {
        Ok(value)
    } else {
        Err(CommandRefusal::NotAProbability(value))
    }
}

/// Returns `value` if it is finite; `name` is the field of the command.
pub fn finite(name: &'static str, value: f64) -> Result<f64, CommandRefusal> {
    if value.is_finite() { Ok(value) } else { Err(CommandRefusal::NotFinite { name, value }) }
}

/// Returns `value` if it is in `range`; `name` is the field of the command.
pub fn within(
    name: &'static str,
    range: RangeInclusive<f64>,
    value: f64,
) -> Result<f64, CommandRefusal> {
    if range.contains(&value) {
        Ok(value)
    } else {
        Err(CommandRefusal::OutOfRange { name, range, value })
    }
}

/// Converts the content of memory from the protocol's type to that of the chips.
pub fn memory(memory: message::Memory, seed: u64) -> MemoryContent {
    match memory {
        message::Memory::Kept => MemoryContent::Kept,
        message::Memory::Zeroed => MemoryContent::Zeroed,
        message::Memory::Noise => MemoryContent::Noise { seed },
    }
}

/// Returns `hz` if it is in the frequency range of the oscillator LSI.
pub fn lsi(range: RangeInclusive<u64>, hz: u64) -> Result<u64, CommandRefusal> {
    if range.contains(&hz) { Ok(hz) } else { Err(CommandRefusal::Lsi { range, hz }) }
}
