//! The oscillator of a robot, by which its script and its frames count time.
//!
//! The rate of an oscillator is off by a constant share. The steps of the script move through the
//! ticks of the world with it, and so do the times at which the robot has frames to send.

use super::TICK_US;

const MILLION: u64 = 1_000_000;

/// An oscillator, and the time on its clock when the world began.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Oscillator {
    /// Millionths by which it is fast; a negative number makes it slow.
    error_ppm: i32,
    /// Time within a tick at which a script with an exact clock has its frames ready, in µs.
    script_us: u32,
}

impl Oscillator {
    /// Returns an oscillator that is fast by `error_ppm` millionths. In the first tick the script
    /// has its frames ready after `script_us`, at most a tick.
    pub(crate) fn new(error_ppm: i32, script_us: u32) -> Self {
        Oscillator { error_ppm, script_us }
    }

    /// Returns the same oscillator with another error.
    pub(crate) fn with_error(self, error_ppm: i32) -> Self {
        Oscillator { error_ppm, ..self }
    }

    /// Returns true for an oscillator without an error.
    #[must_use]
    pub fn is_exact(self) -> bool {
        self.error_ppm == 0
    }

    /// Returns the rate of the clock in millionths of the world's.
    pub(crate) fn rate(self) -> u64 {
        MILLION.saturating_add_signed(self.error_ppm.into())
    }

    /// Returns the time on the clock in µs at the beginning of a tick. An exact clock shows the
    /// time of the world. The product does not overflow: four weeks of the world at twice the rate
    /// are 2^62.
    #[must_use]
    pub fn time_us(self, tick: u64) -> u64 {
        let world_us = tick * u64::from(TICK_US);
        if self.is_exact() {
            return world_us;
        }
        let began_us = TICK_US - self.script_us;
        u64::from(began_us) + world_us.saturating_mul(self.rate()) / MILLION
    }

    /// Returns the time within a tick at which the script has its frames ready, in µs. A step is
    /// executed at the first beginning of a tick after the moment when it was due, and its frames
    /// are ready a tick after that moment.
    pub(crate) fn script_us(self, tick: u64) -> i32 {
        if self.is_exact() {
            return self.script_us as i32;
        }
        let late_us = self.time_us(tick) % u64::from(TICK_US);
        ((u64::from(TICK_US) - late_us) * MILLION / self.rate()) as i32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_hour_of_a_clock_that_is_fast_by_a_percent() {
        let hour = 36_000;
        let at = |error_ppm| Oscillator::new(error_ppm, TICK_US).time_us(hour);
        assert_eq!(at(0), 3_600_000_000);
        assert_eq!(at(10_000), 3_636_000_000);
        assert_eq!(at(-10_000), 3_564_000_000);
    }

    /// Four weeks at the greatest rate that scenarios can have.
    #[test]
    fn the_longest_run_has_a_time() {
        let end = 24_192_000;
        assert_eq!(Oscillator::new(200_000, TICK_US).time_us(end), 2_903_040_000_000);
    }

    /// A clock that is fast by 1 % moves through a tick within a hundred, forward or back.
    #[test]
    fn an_error_moves_the_phase() {
        let phases = |error_ppm| {
            let oscillator = Oscillator::new(error_ppm, 50_000);
            [0, 1, 25, 49, 75, 100].map(|tick| oscillator.script_us(tick))
        };
        assert_eq!(phases(0), [50_000; 6]);
        assert_eq!(phases(10_000), [49_504, 48_514, 24_752, 990, 74_257, 49_504]);
        assert_eq!(phases(-10_000), [50_505, 51_515, 75_757, 100_000, 25_252, 50_505]);
    }
}
