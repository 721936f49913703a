//! The ticks at which steps begin. A missed tick is skipped and counted, never queued.

use embassy_time::{Duration, Instant};

/// The period of the steps and the time of the next one.
pub struct Ticks {
    period: Duration,
    next: Instant,
}

impl Ticks {
    /// Starts the ticks. The first one is a period from now, which is the time for global code and
    /// `init()`.
    pub fn start(period: Duration) -> Self {
        Ticks { period, next: Instant::now() + period }
    }

    /// Returns the time at which the next step begins.
    pub fn next(&self) -> Instant {
        self.next
    }

    /// Advances to the tick one period after the one that was due: a step begins.
    pub fn take(&mut self) {
        self.next += self.period;
    }

    /// Skips the ticks that passed during a step, and returns their number.
    pub fn miss(&mut self) -> u32 {
        let mut missed = 0;
        while self.next <= Instant::now() {
            self.next += self.period;
            missed += 1;
        }
        missed
    }

    /// Skips the ticks that passed while the script waited on purpose.
    pub fn pass(&mut self) {
        let _ = self.miss();
    }
}
