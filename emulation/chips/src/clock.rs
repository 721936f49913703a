//! Conversion between a core's cycles and time.

use crate::Time;

/// A core's clock: its frequency changes, and it stops while the core sleeps.
#[derive(Clone, Copy, Debug)]
pub struct CoreClock {
    hz: u64,
    /// The duration of a cycle in picoseconds, as a fraction in lowest terms. Stored because every
    /// conversion uses it.
    period: (u64, u64),
    /// The clock had counted `cycles` at `time`; conversions start from this point.
    time: Time,
    cycles: u64,
}

impl CoreClock {
    /// Creates a clock that starts at cycle 0 and time 0.
    pub fn new(hz: u64) -> Self {
        CoreClock { hz, period: period(hz), time: Time::ZERO, cycles: 0 }
    }

    /// Returns the frequency in Hz; 0 for a stopped clock.
    pub fn hz(&self) -> u64 {
        self.hz
    }

    /// Returns the time at which `cycles` cycles were counted. A stopped clock returns the time at
    /// which it stopped.
    pub fn time(&self, cycles: u64) -> Time {
        if self.hz == 0 {
            return self.time;
        }
        let (picos, per) = self.period;
        self.time + Time::from_picos((cycles - self.cycles).saturating_mul(picos).div_ceil(per))
    }

    /// Returns the first cycle that is not before `time`.
    pub fn cycle(&self, time: Time) -> u64 {
        if self.hz == 0 {
            return self.cycles;
        }
        // The time of a cycle is rounded up, so the result is the rounded-down quotient or its
        // successor.
        let span = time - self.time;
        let (picos, per) = self.period;
        let cycles = match span.picos().checked_mul(per) {
            Some(product) => product / picos,
            None => span.ticks(self.hz),
        };
        let cycle = self.cycles.saturating_add(cycles);
        if self.time(cycle) < time { cycle.saturating_add(1) } else { cycle }
    }

    /// Changes the frequency to `hz`, from cycle `cycles` on.
    pub fn set_hz(&mut self, hz: u64, cycles: u64) {
        if hz != self.hz {
            *self = CoreClock { hz, period: period(hz), time: self.time(cycles), cycles };
        }
    }

    /// Moves the clock to `time` without counting: the core slept until then.
    pub fn skip_to(&mut self, time: Time, cycles: u64) {
        if time > self.time(cycles) {
            (self.time, self.cycles) = (time, cycles);
        }
    }
}

/// Returns the period of a clock of `hz` in picoseconds, as a reduced fraction. For 0 Hz the result
/// is never used.
fn period(hz: u64) -> (u64, u64) {
    let (mut a, mut b) = (1_000_000_000_000, hz);
    // Euclid's greatest common divisor.
    while b != 0 {
        (a, b) = (b, a % b);
    }
    (1_000_000_000_000 / a, hz / a)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cycles_and_time_agree_through_changes() {
        let mut clock = CoreClock::new(16_000_000);
        assert_eq!(clock.time(16), Time::from_micros(1));
        clock.set_hz(168_000_000, 16);
        assert_eq!(clock.time(16 + 168), Time::from_micros(2));
        clock.skip_to(Time::from_micros(10), 16 + 168);
        assert_eq!(clock.time(16 + 168), Time::from_micros(10));
        let mut stopped = CoreClock::new(0);
        assert_eq!(stopped.time(1), Time::ZERO);
        stopped.skip_to(Time::from_micros(1), 0);
        assert_eq!(stopped.time(1), Time::from_micros(1));
        for nanos in [10_000, 10_001, 12_345, 99_999] {
            let cycle = clock.cycle(Time::from_nanos(nanos));
            assert!(clock.time(cycle) >= Time::from_nanos(nanos));
            assert!(cycle == 184 || clock.time(cycle - 1) < Time::from_nanos(nanos));
        }
    }
}
