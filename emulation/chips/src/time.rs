//! Time since power-on.

use std::ops::{Add, Sub};

/// Picoseconds in a second.
const PICOS: u64 = 1_000_000_000_000;
const KILO: u64 = 1_000;
/// From this frequency on, [`Time::ticks`] computes with 128 bits.
const FASTEST: u64 = 10_000_000_000;

/// A point in time or a span of time, in picoseconds. A cycle at 168 MHz is 5952.38 ps, so rounding
/// stays below a millionth of a cycle per event. 64 bits last for 213 days.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Time(u64);

impl Time {
    /// Power-on.
    pub const ZERO: Time = Time(0);

    /// A time later than every event.
    pub const NEVER: Time = Time(u64::MAX);

    /// Returns a time of `picos` picoseconds.
    pub const fn from_picos(picos: u64) -> Time {
        Time(picos)
    }

    /// Returns a time of `nanos` nanoseconds.
    pub const fn from_nanos(nanos: u64) -> Time {
        Time(nanos.saturating_mul(1_000))
    }

    /// Returns a time of `micros` microseconds.
    pub const fn from_micros(micros: u64) -> Time {
        Time(micros.saturating_mul(1_000_000))
    }

    /// Returns a time of `millis` milliseconds.
    pub const fn from_millis(millis: u64) -> Time {
        Time(millis.saturating_mul(1_000_000_000))
    }

    /// Returns the duration of `ticks` ticks of a clock of `hz`, rounded up: at the returned time
    /// the last tick has happened. For a stopped clock the result is [`Time::NEVER`].
    pub fn of_ticks(ticks: u64, hz: u64) -> Time {
        if hz == 0 {
            return Time::NEVER;
        }
        if hz.is_multiple_of(KILO) {
            // Most clocks are multiples of 1 kHz. For these, 64 bits are enough for the part of a
            // second, which is much faster.
            let part = (ticks % hz * (PICOS / KILO)).div_ceil(hz / KILO);
            return Time((ticks / hz).saturating_mul(PICOS).saturating_add(part));
        }
        let picos = (u128::from(ticks) * u128::from(PICOS)).div_ceil(u128::from(hz));
        Time(u64::try_from(picos).unwrap_or(u64::MAX))
    }

    /// Returns the number of ticks of a clock of `hz` that fit into this span.
    pub fn ticks(self, hz: u64) -> u64 {
        if hz.is_multiple_of(KILO) && hz < FASTEST {
            let part = self.0 % PICOS * (hz / KILO) / (PICOS / KILO);
            return (self.0 / PICOS).saturating_mul(hz).saturating_add(part);
        }
        let ticks = u128::from(self.0) * u128::from(hz) / u128::from(PICOS);
        u64::try_from(ticks).unwrap_or(u64::MAX)
    }

    /// Returns the time in picoseconds.
    pub const fn picos(self) -> u64 {
        self.0
    }

    /// Returns the time in nanoseconds, rounded down.
    pub const fn nanos(self) -> u64 {
        self.0 / 1_000
    }
}

/// The sum saturates at [`Time::NEVER`].
impl Add for Time {
    type Output = Time;

    fn add(self, span: Time) -> Time {
        Time(self.0.saturating_add(span.0))
    }
}

/// The difference saturates at zero.
impl Sub for Time {
    type Output = Time;

    fn sub(self, earlier: Time) -> Time {
        Time(self.0.saturating_sub(earlier.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_and_time_are_inverse() {
        for hz in [32_000, 1_000_000, 42_000_000, 84_000_000, 168_000_000] {
            for ticks in [0, 1, 2, 255, 256, 84_000_001, 1 << 34] {
                assert_eq!(Time::of_ticks(ticks, hz).ticks(hz), ticks, "{ticks} ticks of {hz} Hz");
            }
        }
        assert_eq!(Time::of_ticks(168_000_000, 168_000_000), Time::from_millis(1_000));
    }

    #[test]
    fn all_clocks_are_rounded_alike() {
        for hz in [3, 999, 32_768, 48_000_000, 47_999_999, 168_000_000] {
            for ticks in [1, 7, 1_000_003, 48_000_001, (1 << 33) + 1] {
                let picos = (ticks as u128 * 1_000_000_000_000).div_ceil(hz as u128);
                if picos > u128::from(u64::MAX) {
                    assert_eq!(Time::of_ticks(ticks, hz), Time::NEVER);
                    continue;
                }
                assert_eq!(u128::from(Time::of_ticks(ticks, hz).picos()), picos, "{ticks} of {hz}");
                let before = Time::of_ticks(ticks, hz) - Time::from_picos(1);
                assert_eq!(before.ticks(hz), ticks - 1, "{ticks} of {hz}");
            }
        }
        assert_eq!(Time::from_picos(u64::MAX).ticks(1_000), u64::MAX / 1_000_000_000);
    }

    #[test]
    fn a_stopped_clock_never_reaches_a_time() {
        assert_eq!(Time::of_ticks(1, 0), Time::NEVER);
        assert_eq!(Time::NEVER + Time::from_nanos(1), Time::NEVER);
    }
}
