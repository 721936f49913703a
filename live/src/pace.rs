//! How fast a run goes on.

use std::ops::RangeInclusive;
use std::time::Duration;

/// Ticks per second of real time.
const TICKS_PER_SECOND: f64 = bittybuzz_arena::run::TICKS_PER_SECOND;

/// Rates that a client may ask for, in times of real time.
pub const RATES: RangeInclusive<f64> = 0.1..=1000.0;

/// How a run goes on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Pace {
    /// It stands still.
    Still,
    /// So many ticks remain until it stands still.
    Steps(u32),
    /// It follows the clock.
    Rate {
        /// Times real time.
        rate: f64,
        /// The time on the caller's clock at which the run was at `from`.
        since: Duration,
        /// The tick.
        from: u64,
    },
    /// As fast as it can.
    Unlimited,
}

impl Pace {
    /// Returns the number of ticks that are due for a run at a tick.
    pub fn due(&self, tick: u64, now: Duration) -> u64 {
        match *self {
            Pace::Still => 0,
            Pace::Steps(left) => left.into(),
            Pace::Rate { rate, since, from } => {
                let passed = now.saturating_sub(since).as_secs_f64() * rate * TICKS_PER_SECOND;
                (from + passed as u64).saturating_sub(tick)
            }
            Pace::Unlimited => u64::MAX,
        }
    }

    /// Takes notice of `done` of the `due` ticks, which end at `tick`. What there was no time for is not made up for: a run that is too
    /// slow for its rate is not faster afterwards.
    pub fn passed(&mut self, done: u64, due: u64, tick: u64, now: Duration) {
        match self {
            Pace::Steps(left) if u64::from(*left) <= done => *self = Pace::Still,
            Pace::Steps(left) => *left -= done as u32,
            Pace::Rate { since, from, .. } if done < due => (*since, *from) = (now, tick),
            _ => {}
        }
    }
}
