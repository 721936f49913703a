//! The clock of a robot's script, which may be fast or slow.

use crate::engine::TICK_US;

const MILLION: u64 = 1_000_000;

/// A clock that runs at the rate of the world, or is fast or slow by a constant share.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ScriptClock {
    /// Microseconds of the clock in a second of the world.
    rate: u32,
}

impl ScriptClock {
    /// The clock of the world.
    pub const EXACT: Self = ScriptClock { rate: MILLION as u32 };

    /// Returns a clock that is fast by `ppm` millionths; a negative number makes it slow.
    pub fn fast_by(ppm: i32) -> Self {
        ScriptClock { rate: Self::EXACT.rate.saturating_add_signed(ppm) }
    }

    /// Returns true for the clock of the world.
    pub fn is_exact(self) -> bool {
        self == Self::EXACT
    }

    /// Returns the time of the clock in µs at the beginning of a tick. The product does not
    /// overflow: four weeks of the world at twice the rate are 2^62.
    pub fn time_us(self, tick: u64) -> u64 {
        let world_us = tick * u64::from(TICK_US);
        if self.is_exact() { world_us } else { world_us.saturating_mul(self.rate.into()) / MILLION }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_hour_of_a_clock_that_is_fast_by_a_percent() {
        let hour = 36_000;
        assert_eq!(ScriptClock::EXACT.time_us(hour), 3_600_000_000);
        assert_eq!(ScriptClock::fast_by(10_000).time_us(hour), 3_636_000_000);
        assert_eq!(ScriptClock::fast_by(-10_000).time_us(hour), 3_564_000_000);
    }

    /// Four weeks at the greatest rate that scenarios can have.
    #[test]
    fn the_longest_run_has_a_time() {
        let end = 24_192_000;
        assert_eq!(ScriptClock::fast_by(200_000).time_us(end), 2_903_040_000_000);
    }
}
