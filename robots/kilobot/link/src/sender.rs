//! The times at which to send, as in kilolib, whose timer checks every 255 units of 128 µs.

use crate::clock::is_past;

/// The minimum time from one message to the next: two per second (`kilo_tx_period`).
const PERIOD: u16 = 3906;
/// The time to the timer's next check, which is awaited while a message is being received.
const CHECK_PERIOD: u16 = 255;

/// The time of the next message.
#[derive(Debug)]
pub struct Sender {
    next: u16,
}

impl Sender {
    /// Plans the first message `wait` units after `now`, so that robots do not start together.
    pub const fn start(now: u16, wait: u8) -> Self {
        Sender { next: now.wrapping_add(wait as u16) }
    }

    /// Returns true if a message may be sent. Call this function at least every four seconds, even
    /// if there is no message.
    pub fn is_due(&mut self, now: u16) -> bool {
        let is_due = is_past(self.next, now);
        if is_due {
            // The time stays within four seconds of `now`, which `is_past` needs.
            self.next = now;
        }
        is_due
    }

    /// Waits for the timer's next check, because a message is being received.
    pub fn wait(&mut self, now: u16) {
        self.next = now.wrapping_add(CHECK_PERIOD);
    }

    /// Plans the next message after one was sent.
    pub fn sent(&mut self, now: u16) {
        self.next = now.wrapping_add(PERIOD);
    }

    /// Plans another attempt after `wait` units, drawn at random, because another robot was
    /// sending.
    pub fn collided(&mut self, now: u16, wait: u8) {
        self.next = now.wrapping_add(u16::from(wait));
    }
}
