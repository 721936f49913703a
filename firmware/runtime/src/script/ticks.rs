//! The beat of the steps. A missed tick is skipped and counted, never queued.

use embassy_time::{Duration, Instant};

/// The times at which steps begin.
pub struct Ticks {
    period: Duration,
    next: Instant,
}

impl Ticks {
    /// The first tick is one period from now: global code and `init()` have that long.
    pub fn start(period: Duration) -> Self {
        Ticks { period, next: Instant::now() + period }
    }

    /// Returns the time at which the next step begins.
    pub fn next(&self) -> Instant {
        self.next
    }

    /// A step begins: the next follows one period after this one was due.
    pub fn take(&mut self) {
        self.next += self.period;
    }

    /// Skips the ticks that have passed during a step, and counts them.
    pub fn miss(&mut self) -> u32 {
        let mut missed = 0;
        while self.next <= Instant::now() {
            self.next += self.period;
            missed += 1;
        }
        missed
    }

    /// Skips the ticks that have passed, on purpose.
    pub fn pass(&mut self) {
        let _ = self.miss();
    }
}
