//! The pace of a run.

use std::ops::RangeInclusive;
use std::time::Duration;

/// The valid rates, in multiples of real time.
pub const RATES: RangeInclusive<f64> = 0.1..=1000.0;

/// The pace of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Pace {
    /// The run is paused.
    Paused,
    /// The run pauses after this number of further ticks.
    Steps(u32),
    /// The run follows the caller's clock.
    Rate {
        /// The speed as a multiple of real time.
        rate: f64,
        /// The time on the caller's clock at which the run was at tick `from`.
        since: Duration,
        /// The tick at the time `since`.
        from: u64,
    },
    /// The run uses all the time that the caller gives.
    Unlimited,
}

impl Pace {
    /// Returns the pace of a run that plays from a tick on. Without a rate it has no limit.
    pub fn play(rate: Option<f64>, now: Duration, tick: u64) -> Pace {
        match rate {
            None => Pace::Unlimited,
            Some(rate) => Pace::Rate { rate, since: now, from: tick },
        }
    }

    /// Returns the message for a rate outside the [`RATES`].
    pub fn refusal(rate: f64) -> String {
        format!("{rate} cannot be `rate`, which is from {} to {}", RATES.start(), RATES.end())
    }

    /// Returns the number of ticks that are due at the time `now`, for a run that is at `tick` and
    /// has `ticks_per_second` in real time.
    pub fn due(&self, tick: u64, now: Duration, ticks_per_second: f64) -> u64 {
        match *self {
            Pace::Paused => 0,
            Pace::Steps(left) => left.into(),
            Pace::Rate { rate, since, from } => {
                let passed = now.saturating_sub(since).as_secs_f64() * rate * ticks_per_second;
                (from + passed as u64).saturating_sub(tick)
            }
            Pace::Unlimited => u64::MAX,
        }
    }

    /// Records that `done` of the `due` ticks have passed, up to `tick`. Ticks for which there was
    /// no time are skipped, so that a run that was too slow for its rate does not speed up
    /// afterwards.
    pub fn passed(&mut self, done: u64, due: u64, tick: u64, now: Duration) {
        match self {
            Pace::Steps(left) if u64::from(*left) <= done => *self = Pace::Paused,
            Pace::Steps(left) => *left -= done as u32,
            Pace::Rate { since, from, .. } if done < due => (*since, *from) = (now, tick),
            _ => {}
        }
    }
}
