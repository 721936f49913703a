//! Which commands a board obeys.

use std::ops::RangeInclusive;

use bittybuzz_chips::f405::OTP;
use bittybuzz_chips::{Board, MAX_PAYLOAD, Memory, P2P_MAX};

use crate::message::{self, BoardStatistics, Command};

/// A board that receives changes of its robot's surroundings.
pub trait Control: Board {
    /// The robot's usual name.
    const NAME: &'static str;

    /// Obeys a command that concerns the board.
    fn obey(&mut self, command: Command) -> Result<(), Refusal>;

    /// Returns its counters since power-on.
    fn counted(&self) -> BoardStatistics;
}

/// A reason why a board refuses a command.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Refusal {
    /// Too much for the link.
    #[error("a frame's payload has at most {MAX_PAYLOAD} bytes, this one has {0}")]
    FrameTooLong(usize),
    /// Too much for the radio.
    #[error("a P2P frame has at most {P2P_MAX} bytes, this one has {0}")]
    P2pTooLong(usize),
    /// Not between 0 and 1.
    #[error("a probability is between 0 and 1, not {0}")]
    NotAProbability(f64),
    /// Not a number that makes sense there.
    #[error("{name} is a finite number, not {value}")]
    NotFinite {
        /// The member of the command.
        name: &'static str,
        /// The refused value.
        value: f64,
    },
    /// Edges cannot be that late.
    #[error("jitter_us is between 0 and {most}, not {value}")]
    Jitter {
        /// The highest value.
        most: f64,
        /// The refused value.
        value: f64,
    },
    /// No lamp is so bad.
    #[error("glitches_per_s is between 0 and {most}, not {value}")]
    Glitches {
        /// The limit.
        most: f64,
        /// The number in the command.
        value: f64,
    },
    /// No oscillator is so wrong.
    #[error("error_ppm is between -{most} and {most}, not {value}")]
    ClockError {
        /// The highest magnitude.
        most: f64,
        /// The refused value.
        value: f64,
    },
    /// No oscillator of this chip is so slow or so fast.
    #[error("lsi_hz is between {} and {}, not {hz}", .range.start(), .range.end())]
    Lsi {
        /// The range in the data sheet.
        range: RangeInclusive<u64>,
        /// The number in the command.
        hz: u64,
    },
    /// The chip has fewer.
    #[error("a Crazyflie has {OTP} one-time programmable bytes, not {0}")]
    Otp(usize),
    /// The STM32 could not obey flow control.
    #[error("rts_bytes is between 1 and {most}, not {value}")]
    RtsBytes {
        /// The limit.
        most: u8,
        /// The number in the command.
        value: u8,
    },
    /// Longer than any test waits.
    #[error("ble_shutdown_us is at most 1000000, not {0}")]
    BleShutdown(u64),
    /// No frame of a Kilobot has that length.
    #[error(
        "a Kilobot's frame is 9 bytes of data and its type, and 2 of its checksum or none: 10 or 12, not {0}"
    )]
    Infrared(usize),
    /// Another robot has it.
    #[error("a {0} has no such thing; docs/emulation.md says which robot obeys which command")]
    OtherRobot(&'static str),
}

/// `value`, if it is a probability.
pub fn probability(value: f64) -> Result<f64, Refusal> {
    if (0.0..=1.0).contains(&value) { Ok(value) } else { Err(Refusal::NotAProbability(value)) }
}

/// `value`, if it is finite; `name` is the member of the command.
pub fn finite(name: &'static str, value: f64) -> Result<f64, Refusal> {
    if value.is_finite() { Ok(value) } else { Err(Refusal::NotFinite { name, value }) }
}

/// The content of memory as the chips know it.
pub fn memory(memory: message::Memory, seed: u64) -> Memory {
    match memory {
        message::Memory::Kept => Memory::Kept,
        message::Memory::Zeroed => Memory::Zeroed,
        message::Memory::Noise => Memory::Noise { seed },
    }
}

/// `hz`, if an oscillator LSI can be so fast.
pub fn lsi(range: RangeInclusive<u64>, hz: u64) -> Result<u64, Refusal> {
    if range.contains(&hz) { Ok(hz) } else { Err(Refusal::Lsi { range, hz }) }
}
