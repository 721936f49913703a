//! Pulses of light to the bytes of a message.
//!
//! A bit takes 269 cycles of 8 MHz: a short pulse is 1, none is 0. A byte is a start bit (1), eight
//! bits, the lowest first, and
//! a stop bit (1). A message is a byte 0, whose two pulses give the sender's loudness, and twelve
//! bytes.
//!
//! Each byte is measured from its own start bit, so that the clocks of sender and receiver may
//! differ by -5 to +4 percent.

use crate::distance::Amplitudes;

/// Cycles of a bit (kilolib, `rx_bitcycles`).
pub const BIT: u16 = 269;

/// Cycles after a start bit in which a stop bit, and then the next start bit, must have come (`rx_msgcycles`).
pub const DEADLINE: u16 = 11 * BIT;

/// Later no stop bit comes. kilolib allows nine bits and a half, but those that it sends take 270 cycles, and a sender whose clock is
/// 5 % slow needs 9.53.
const LATEST_STOP: u16 = 9 * BIT + BIT * 2 / 3;

/// Bytes of a message.
pub const MESSAGE: usize = 12;

/// The meaning of a pulse.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pulse {
    /// The first of a message: measure it with the high gain. The deadline begins.
    First,
    /// The second of a message: measure it with the low gain.
    Second,
    /// The start of another byte: its deadline begins.
    Start,
    /// Within a byte.
    Inside,
    /// The last of a message, which is complete.
    Last,
    /// None of a message: two senders at once, or noise. The receiver waits for a message again.
    Stray,
}

/// A message, and how loud it was.
#[derive(Clone, Copy, Debug)]
pub struct Heard {
    /// Its bytes, perhaps damaged.
    pub message: [u8; MESSAGE],
    /// The amplitudes of its first two pulses.
    pub amplitudes: Amplitudes,
}

/// Before a message.
const IDLE: u8 = 0;

/// Receives messages.
#[derive(Debug)]
pub struct Receiver {
    /// The place of the next pulse: 2 n before byte n, 2 n + 1 within it. Byte 0 is the one that
    /// gives the sender's loudness.
    place: u8,
    /// The time of the byte's start bit.
    start: u16,
    value: u8,
    /// The message is whole from [`Pulse::Last`] to the next [`Pulse::Start`]. The amplitudes are the caller's to measure.
    pub heard: Heard,
}

impl Receiver {
    /// Waits for a message.
    pub const fn new() -> Self {
        let amplitudes = Amplitudes { high_gain: 0, low_gain: 0 };
        let heard = Heard { message: [0; MESSAGE], amplitudes };
        Receiver { place: IDLE, start: 0, value: 0, heard }
    }

    /// Returns true if a message is being received.
    #[inline(always)]
    pub fn is_busy(&self) -> bool {
        self.place != IDLE
    }

    /// The deadline has passed.
    #[inline(always)]
    pub fn give_up(&mut self) {
        self.place = IDLE;
    }

    /// There was a pulse, at this cycle (modulo 65536).
    #[inline(always)]
    pub fn pulse(&mut self, at: u16) -> Pulse {
        let place = self.place;
        self.place = place.wrapping_add(1);
        if place & 1 == 0 {
            self.start = at;
            self.value = 0;
            return if place == IDLE { Pulse::First } else { Pulse::Start };
        }
        let since = at.wrapping_sub(self.start);
        if since <= BIT / 2 || since >= LATEST_STOP {
            self.give_up();
            return Pulse::Stray;
        }
        let bit = bit_at(since);
        if bit != 0 {
            self.place = place;
            self.value |= bit;
            return Pulse::Inside;
        }
        let byte = usize::from(place / 2);
        match self.heard.message.get_mut(byte.wrapping_sub(1)) {
            Some(room) => *room = self.value,
            None if self.value == 0 => return Pulse::Second,
            None => {
                self.give_up();
                return Pulse::Stray;
            }
        }
        if byte < MESSAGE {
            return Pulse::Inside;
        }
        self.give_up();
        Pulse::Last
    }
}

impl Default for Receiver {
    fn default() -> Self {
        Self::new()
    }
}

/// Returns the bit at this number of cycles after the start, 0 for the stop bit: from half a bit to
/// nine and a half.
#[inline(always)]
fn bit_at(since: u16) -> u8 {
    let mut bit = 1_u8;
    let mut rest = since - BIT / 2;
    // Of all pulses, this one needs the longest work.
    if rest >= 8 * BIT {
        return 0;
    }
    while rest >= BIT {
        rest -= BIT;
        bit <<= 1;
    }
    bit
}
