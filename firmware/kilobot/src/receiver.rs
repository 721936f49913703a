//! Pulses of light to the bytes of a message.
//!
//! A bit takes 269 cycles of 8 MHz: a short pulse is 1, none is 0. A byte is a start bit (1), eight bits, the lowest first, and
//! a stop bit (1). A message is a byte 0, whose two pulses tell how loud the sender is, and twelve bytes.
//!
//! Each byte is measured from its own start bit, so that the clocks of sender and receiver may differ by -5 to +4 percent.

/// Cycles of a bit (kilolib, `rx_bitcycles`).
pub const BIT: u16 = 269;

/// Cycles after a start bit in which a stop bit, and then the next start bit, must have come (`rx_msgcycles`).
pub const DEADLINE: u16 = 11 * BIT;

/// Later no stop bit comes. kilolib allows nine bits and a half, but those that it sends take 270 cycles, and a sender whose clock is
/// 5 % slow needs 9.53.
const LATEST_STOP: u16 = 9 * BIT + BIT * 2 / 3;

/// Bytes of a message.
pub const MESSAGE: usize = 12;

/// What a pulse was.
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

/// Where in a message the next pulse is expected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Place {
    /// Before it.
    Idle,
    /// In the byte 0.
    Lead,
    /// Before this byte.
    Before(u8),
    /// In it.
    In(u8),
}

/// Receives messages.
#[derive(Debug)]
pub struct Receiver {
    place: Place,
    /// When the byte's start bit was.
    start: u16,
    value: u8,
    message: [u8; MESSAGE],
}

impl Receiver {
    /// Waits for a message.
    pub const fn new() -> Self {
        Receiver { place: Place::Idle, start: 0, value: 0, message: [0; MESSAGE] }
    }

    /// Whether a message comes in.
    #[inline(always)]
    pub fn is_busy(&self) -> bool {
        self.place != Place::Idle
    }

    /// The message, from [`Pulse::Last`] to the next [`Pulse::Start`].
    #[inline(always)]
    pub fn message(&self) -> &[u8; MESSAGE] {
        &self.message
    }

    /// The deadline has passed.
    #[inline(always)]
    pub fn give_up(&mut self) {
        self.place = Place::Idle;
    }

    /// There was a pulse, at this cycle (modulo 65536).
    #[inline(always)]
    pub fn pulse(&mut self, at: u16) -> Pulse {
        let index = match self.place {
            Place::Idle => {
                self.begin(at, Place::Lead);
                return Pulse::First;
            }
            Place::Before(index) => {
                self.begin(at, Place::In(index));
                return Pulse::Start;
            }
            Place::Lead => None,
            Place::In(index) => Some(index),
        };
        let since = at.wrapping_sub(self.start);
        if since <= BIT / 2 || since >= LATEST_STOP {
            self.give_up();
            return Pulse::Stray;
        }
        let bit = bit_at(since);
        if bit < 8 {
            self.value |= 1 << bit;
            return Pulse::Inside;
        }
        match index {
            None if self.value != 0 => {
                self.give_up();
                Pulse::Stray
            }
            None => {
                self.place = Place::Before(0);
                Pulse::Second
            }
            Some(index) => {
                if let Some(byte) = self.message.get_mut(usize::from(index)) {
                    *byte = self.value;
                }
                if usize::from(index) + 1 < MESSAGE {
                    self.place = Place::Before(index + 1);
                    Pulse::Inside
                } else {
                    self.give_up();
                    Pulse::Last
                }
            }
        }
    }

    #[inline(always)]
    fn begin(&mut self, at: u16, place: Place) {
        self.place = place;
        self.start = at;
        self.value = 0;
    }
}

impl Default for Receiver {
    fn default() -> Self {
        Self::new()
    }
}

/// Which bit is so many cycles behind the start: 0 to 7, 8 for the stop bit. From half a bit to nine and a half.
#[inline(always)]
fn bit_at(since: u16) -> u8 {
    // The rounded quotient by 269, by a product: 65536 / 269 = 244, rounded up.
    const INVERSE: u32 = 65_536_u32.div_ceil(BIT as u32);
    ((u32::from(since - BIT / 2) * INVERSE) >> 16) as u8
}
