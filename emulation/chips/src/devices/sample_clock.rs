//! The clock of a sensor's samples.

use crate::Time;

/// The times of samples at a constant rate, without accumulation of rounding errors.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct SampleClock {
    begin: Time,
    /// The rate in 10⁻¹² Hz.
    pico_hz: u64,
    /// Periods from `begin` to the next sample.
    periods: u64,
}

impl SampleClock {
    /// Returns a clock whose first sample is one period after `begin`.
    ///
    /// # Parameters
    /// `deviation_ppm`: deviation from the nominal rate, in millionths of it.
    pub(super) fn new(begin: Time, micro_hz: u64, deviation_ppm: i32) -> Self {
        let millionths = 1_000_000_u64.saturating_add_signed(deviation_ppm.into());
        SampleClock { begin, pico_hz: micro_hz * millionths, periods: 1 }
    }

    /// Returns a clock whose first sample is at `first`.
    pub(super) fn with_first(first: Time, micro_hz: u64, deviation_ppm: i32) -> Self {
        SampleClock { periods: 0, ..SampleClock::new(first, micro_hz, deviation_ppm) }
    }

    /// Returns the time of the next sample.
    pub(super) fn next(&self) -> Time {
        let periods = u128::from(self.periods);
        let picos = (periods * 1_000_000_000_000_000_000_000_000).div_ceil(self.pico_hz.into());
        self.begin + Time::from_picos(u64::try_from(picos).unwrap_or(u64::MAX))
    }

    /// Passes the next sample if it is due, and returns its time.
    pub(super) fn take_due(&mut self, now: Time) -> Option<Time> {
        let at = self.next();
        (at <= now).then(|| {
            self.periods += 1;
            at
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_are_exact_over_long_times() {
        // 12.5 Hz, and 1 kHz that is 0.3 % too fast.
        for (hz, ppm, per_hour) in [(12.5, 0, 45_000), (1_000.0, 3_000, 3_610_800)] {
            let mut clock = SampleClock::new(Time::from_micros(7), (hz * 1e6) as u64, ppm);
            let end = Time::from_micros(7) + Time::from_millis(3_600_000);
            let count = std::iter::from_fn(|| clock.take_due(end)).count();
            assert_eq!(count, per_hour);
            assert!(clock.next() > end);
        }
    }
}
