//! The times at which to send, as in kilolib, whose timer checks every 255 units of 128 µs.

use crate::clock::is_past;

/// The minimum time from one message to the next: two per second (`kilo_tx_period`).
const PERIOD: u16 = 3906;
/// The time from one fragment of a long message to the next, 33 ms: few other robots begin a message
/// meanwhile, so that receivers have places for all of them.
const SPACING: u16 = 256;
/// The most fragments for which the pause after a message makes up, so that the mean rate stays two
/// per second. The pause is then 2.8 s; neighbors would forget the robot after 3 s.
const EARLY_MAX: u8 = 5;
/// The most times in a row that a robot lets others finish their messages: twice the fragments of the
/// longest one. Robots that begin messages and do not finish them delay others for half a second.
const DEFERRALS_MAX: u8 = 16;
/// The time to the timer's next check, which is awaited while a message is being received.
const CHECK_PERIOD: u16 = 255;

/// The time of the next message. A robot whose image has no long messages (`HAS_LONG`) saves the flash
/// for them; its neighbors, which have the same script, send none.
#[derive(Debug)]
pub struct Sender<const HAS_LONG: bool> {
    next: u16,
    /// The number of fragments that were sent [`SPACING`] instead of [`PERIOD`] after another one.
    early: u8,
    /// The number of times that the robot has let others finish their messages since a message was due.
    deferrals: u8,
}

impl<const HAS_LONG: bool> Sender<HAS_LONG> {
    /// Plans the first message `wait` units after `now`, so that robots do not start together.
    pub const fn start(now: u16, wait: u8) -> Self {
        Sender { next: now.wrapping_add(wait as u16), early: 0, deferrals: 0 }
    }

    /// Returns true if a message may be sent. Call this function at least every four seconds, even
    /// if there is no message.
    pub fn is_due(&mut self, now: u16) -> bool {
        let is_due = is_past(self.next, now);
        if is_due {
            // The time stays within four seconds of `now`, which `is_past` needs.
            self.next = now;
            if HAS_LONG {
                self.deferrals = 0;
            }
        }
        is_due
    }

    /// Waits for the timer's next check, because a message is being received.
    pub fn wait(&mut self, now: u16) {
        self.next = now.wrapping_add(CHECK_PERIOD);
    }

    /// Lets another robot finish its long message, of which a fragment has arrived that is not the last
    /// one: plans the next message `random` units after the time of the next fragment, so that those
    /// who wait do not begin together. Receivers have places for few messages at the same time.
    pub fn defer(&mut self, now: u16, random: u8) {
        let at = now.wrapping_add(SPACING + u16::from(random));
        if HAS_LONG && self.deferrals != DEFERRALS_MAX && is_past(self.next, at) {
            self.deferrals += 1;
            self.next = at;
        }
    }

    /// Plans the next message after one was sent. `is_within` is true if it was a fragment, and the
    /// next fragment of the same message waits.
    pub fn sent(&mut self, now: u16, is_within: bool) {
        let mut wait = PERIOD;
        if HAS_LONG && is_within {
            wait = SPACING;
            self.early = (self.early + 1).min(EARLY_MAX);
        } else if HAS_LONG {
            wait += u16::from(self.early) * (PERIOD - SPACING);
            self.early = 0;
        }
        self.next = now.wrapping_add(wait);
    }

    /// Plans another attempt after `wait` units, drawn at random, because another robot was
    /// sending.
    pub fn collided(&mut self, now: u16, wait: u8) {
        self.next = now.wrapping_add(u16::from(wait));
    }
}
