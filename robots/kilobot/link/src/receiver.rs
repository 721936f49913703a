//! The receiver, which turns pulses of light into the bytes of a message.
//!
//! A bit takes 269 cycles of 8 MHz: a short pulse is 1, no pulse is 0. A byte is a start bit (1),
//! eight bits, the lowest first, and a stop bit (1). A message is a byte 0, whose two pulses serve
//! to measure the amplitude, and twelve bytes.
//!
//! The bits of each byte are timed from its own start bit, so the clocks of sender and receiver may
//! differ by -5 to +4 percent.

use crate::distance::Amplitudes;

/// The length of a bit in cycles (kilolib, `rx_bitcycles`).
pub const BIT: u16 = 269;

/// The time in cycles after a start bit by which the stop bit and the next start bit must have come
/// (`rx_msgcycles`).
pub const DEADLINE: u16 = 11 * BIT;

/// The latest time of a stop bit, in cycles after the start bit. kilolib allows nine and a half
/// bits, but the bits that it sends take 270 cycles, and a sender with a clock that is 5 % slow
/// needs 9.53.
const LATEST_STOP: u16 = 9 * BIT + BIT * 2 / 3;

/// The length of a message, in bytes.
pub const MESSAGE: usize = 12;

/// The meaning of a pulse.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pulse {
    /// The first pulse of a message. It is measured with the high gain, and the deadline begins.
    First,
    /// The second pulse of a message. It is measured with the low gain.
    Second,
    /// The start bit of another byte, at which its deadline begins.
    Start,
    /// A pulse within a byte.
    Inside,
    /// The last pulse of a message, which is complete.
    Last,
    /// A pulse that fits no message, from two senders at once or from noise. The receiver waits for
    /// a message again.
    Stray,
}

/// A received message and its amplitudes.
#[derive(Clone, Copy, Debug)]
pub struct ReceivedMessage {
    /// The bytes, which may be damaged.
    pub message: [u8; MESSAGE],
    /// The amplitudes of the first two pulses.
    pub amplitudes: Amplitudes,
}

/// The place before a message.
const IDLE: u8 = 0;

/// The state of the reception of a message.
#[derive(Debug)]
pub struct Receiver {
    /// The place of the next pulse: 2 n before byte n, 2 n + 1 within it. Byte 0 serves to measure
    /// the amplitude.
    place: u8,
    /// The time of the byte's start bit.
    start: u16,
    value: u8,
    /// The message, which is complete from [`Pulse::Last`] to the next [`Pulse::Start`]. The caller
    /// measures the amplitudes.
    pub received: ReceivedMessage,
}

impl Receiver {
    /// Returns a receiver that waits for a message.
    pub const fn new() -> Self {
        let amplitudes = Amplitudes { high_gain: 0, low_gain: 0 };
        let received = ReceivedMessage { message: [0; MESSAGE], amplitudes };
        Receiver { place: IDLE, start: 0, value: 0, received }
    }

    /// Returns true if a message is being received.
    #[inline(always)]
    pub fn is_busy(&self) -> bool {
        self.place != IDLE
    }

    /// Discards the message that is being received: the deadline has passed.
    #[inline(always)]
    pub fn give_up(&mut self) {
        self.place = IDLE;
    }

    /// Handles a pulse at this cycle (modulo 65536).
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
        match self.received.message.get_mut(byte.wrapping_sub(1)) {
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

/// Returns the mask of the bit at this number of cycles after the start, from half a bit to nine
/// and a half; 0 for the stop bit.
#[inline(always)]
fn bit_at(since: u16) -> u8 {
    let mut bit = 1_u8;
    let mut rest = since - BIT / 2;
    // The stop bit is checked first, because the longest work follows its pulse.
    if rest >= 8 * BIT {
        return 0;
    }
    while rest >= BIT {
        rest -= BIT;
        bit <<= 1;
    }
    bit
}
