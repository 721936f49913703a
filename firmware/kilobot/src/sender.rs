//! The times to send: as kilolib, whose timer checks every 255 units of 128 µs.

use crate::clock::is_past;

/// The least time from one message to the next: two per second (`kilo_tx_period`).
const PERIOD: u16 = 3906;
/// While a message comes in, the timer's next turn is waited for.
const TURN: u16 = 255;

/// Paces messages.
#[derive(Debug)]
pub struct Sender {
    next: u16,
}

impl Sender {
    /// Plans the first message `wait` units after `now`, so that robots do not start together.
    pub const fn start(now: u16, wait: u8) -> Self {
        Sender { next: now.wrapping_add(wait as u16) }
    }

    /// Returns true if a message may be tried. Must be called at least every four seconds, even if
    /// there is none.
    pub fn is_due(&mut self, now: u16) -> bool {
        let is_due = is_past(self.next, now);
        if is_due {
            // Never more than four seconds ago.
            self.next = now;
        }
        is_due
    }

    /// A message comes in.
    pub fn wait(&mut self, now: u16) {
        self.next = now.wrapping_add(TURN);
    }

    /// It was sent.
    pub fn sent(&mut self, now: u16) {
        self.next = now.wrapping_add(PERIOD);
    }

    /// Another robot sends: plans another attempt after `wait` units, drawn at random.
    pub fn collided(&mut self, now: u16, wait: u8) {
        self.next = now.wrapping_add(u16::from(wait));
    }
}
