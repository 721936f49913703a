//! When to send: as kilolib, whose timer asks every 255 units of 128 µs whether it is time.

use crate::clock::is_past;

/// At least so long from one message to the next: two a second (`kilo_tx_period`).
const PERIOD: u16 = 3906;
/// While a message comes in, the timer's next turn is waited for.
const TURN: u16 = 255;

/// Paces messages.
#[derive(Debug)]
pub struct Sender {
    next: u16,
}

impl Sender {
    /// The first message so many units after `now`: not all robots at once.
    pub const fn start(now: u16, wait: u8) -> Self {
        Sender { next: now.wrapping_add(wait as u16) }
    }

    /// Whether a message may be tried. To be asked at least every four seconds, even if there is none.
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

    /// Another robot sends; try again after so many units, at random.
    pub fn collided(&mut self, now: u16, wait: u8) {
        self.next = now.wrapping_add(u16::from(wait));
    }
}
