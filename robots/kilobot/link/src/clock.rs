//! The time in units of 128 µs (8 MHz / 1024), modulo 65536, which is 8.4 seconds.

/// The whole units in a step of 100 ms, which has 781.25.
const STEP: u16 = 781;

/// Converts up to 4,000 ms to units, rounded up: 7.8125 for each ms.
pub const fn units(ms: u16) -> u16 {
    ms * 8 - ms * 3 / 16
}

/// Returns true if `at` is not after `now`, for times that are less than four seconds apart.
pub const fn is_past(at: u16, now: u16) -> bool {
    (now.wrapping_sub(at) as i16) >= 0
}

/// A clock of ten ticks per second.
#[derive(Debug)]
pub struct Ticks {
    next: u16,
    quarter: u8,
}

impl Ticks {
    /// Returns ticks of which the first is due at `now`.
    pub const fn start(now: u16) -> Self {
        Ticks { next: now, quarter: 0 }
    }

    /// Returns true if a tick is due. Ticks that were not taken in time are skipped.
    #[inline(never)]
    pub fn take(&mut self, now: u16) -> bool {
        let mut is_tick = false;
        while is_past(self.next, now) {
            self.quarter = (self.quarter + 1) & 3;
            self.next = self.next.wrapping_add(STEP + u16::from(self.quarter == 0));
            is_tick = true;
        }
        is_tick
    }
}

/// A wait of up to 65 seconds. [`Delay::is_over`] must be called at least every four seconds.
#[derive(Debug)]
pub struct Delay {
    since: u16,
    ms: u16,
}

/// The part of a long wait that is subtracted at once, in ms.
const PART: u16 = 1024;

impl Delay {
    /// Starts a wait of `ms` from now on.
    pub const fn start(now: u16, ms: u16) -> Self {
        Delay { since: now, ms }
    }

    /// Returns true if the wait is over.
    pub fn is_over(&mut self, now: u16) -> bool {
        let elapsed = now.wrapping_sub(self.since);
        if self.ms <= PART {
            return elapsed >= units(self.ms);
        }
        if elapsed >= units(PART) {
            self.since = self.since.wrapping_add(units(PART));
            self.ms -= PART;
        }
        false
    }
}
