//! The internal RC oscillator (chapter 9.6), whose frequency is slightly wrong on every robot.

use crate::Time;

/// The calibrated frequency in Hz.
pub const NOMINAL_HZ: u64 = 8_000_000;

/// The relative change of the frequency by a step of OSCCAL: the data sheet shows about half an
/// octave for the 128 steps of a range.
const STEP: f64 = 0.004;
/// The beginning of OSCCAL's upper range, in steps above the beginning of the lower range. The two
/// ranges overlap.
const UPPER_RANGE: f64 = 80.0;

const FEMTOS: f64 = 1e15;
const FEMTOS_PER_PICO: u128 = 1000;

/// The conversion between cycles of the core and time.
#[derive(Clone, Debug)]
pub struct RcClock {
    base_cycle: u64,
    base: Time,
    /// The period of a cycle in fs.
    period: u64,
    /// The OSCCAL at which the oscillator has its nominal frequency, apart from its error.
    best: u8,
    osccal: u8,
    /// CLKPS: the core's clock is divided by 2^`divider`.
    divider: u8,
    error_ppm: f64,
}

impl RcClock {
    /// Creates an oscillator that has its nominal frequency at OSCCAL `best`, and starts with
    /// `osccal`.
    pub fn new(best: u8, osccal: u8) -> Self {
        let mut clock = RcClock {
            base_cycle: 0,
            base: Time::ZERO,
            period: 0,
            best,
            osccal,
            divider: 0,
            error_ppm: 0.0,
        };
        clock.set_period();
        clock
    }

    fn set_period(&mut self) {
        let position =
            |osccal: u8| f64::from(osccal & 0x7f) + if osccal > 0x7f { UPPER_RANGE } else { 0.0 };
        let steps = position(self.osccal) - position(self.best);
        let hz = NOMINAL_HZ as f64 * (1.0 + STEP * steps) * (1.0 + self.error_ppm * 1e-6);
        self.period = (FEMTOS / hz).round() as u64 * (1 << self.divider);
    }

    fn change(&mut self, cycle: u64, change: impl FnOnce(&mut Self)) {
        self.base = self.time(cycle);
        self.base_cycle = cycle;
        change(self);
        self.set_period();
    }

    pub(crate) fn osccal(&self) -> u8 {
        self.osccal
    }

    pub(crate) fn set_osccal(&mut self, cycle: u64, osccal: u8) {
        self.change(cycle, |clock| clock.osccal = osccal);
    }

    pub(crate) fn set_divider(&mut self, cycle: u64, divider: u8) {
        self.change(cycle, |clock| clock.divider = divider.min(8));
    }

    /// Sets the oscillator's error in millionths from `cycle` on; positive is too fast.
    pub fn set_error(&mut self, cycle: u64, error_ppm: f64) {
        self.change(cycle, |clock| clock.error_ppm = error_ppm);
    }

    /// Returns the time at which a cycle begins.
    pub fn time(&self, cycle: u64) -> Time {
        let cycles = u128::from(cycle.saturating_sub(self.base_cycle));
        self.base + Time::from_picos((cycles * u128::from(self.period) / FEMTOS_PER_PICO) as u64)
    }

    /// Returns the first cycle that begins at `time` or later.
    pub fn cycle(&self, time: Time) -> u64 {
        if time == Time::NEVER {
            return u64::MAX;
        }
        let span = u128::from((time - self.base).picos()) * FEMTOS_PER_PICO;
        self.base_cycle + span.div_ceil(u128::from(self.period)) as u64
    }

    /// Returns the number of cycles that fit into a span.
    pub fn cycles_of(&self, span: Time) -> u64 {
        (u128::from(span.picos()) * FEMTOS_PER_PICO / u128::from(self.period)) as u64
    }

    /// Returns the frequency of the core.
    pub fn hz(&self) -> f64 {
        FEMTOS / self.period as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cycles_and_times_belong_together_through_changes() {
        let mut clock = RcClock::new(0x9c, 0x9c);
        assert_eq!(clock.time(8_000_000), Time::from_millis(1000));
        clock.set_error(8_000_000, 10_000.0);
        // 1 % faster.
        let cycle = clock.cycle(Time::from_millis(2000));
        assert!(cycle.abs_diff(8_000_000 + 8_080_000) <= 1, "{cycle}");
        clock.set_divider(16_080_000, 3);
        assert!(clock.cycles_of(Time::from_millis(1000)).abs_diff(1_010_000) <= 1);
        for cycle in [16_080_000, 16_080_001, 20_000_003, 1 << 40] {
            assert_eq!(clock.cycle(clock.time(cycle)), cycle);
        }
    }

    #[test]
    fn osccal_moves_the_frequency_and_its_ranges_overlap() {
        let hz = |osccal| RcClock::new(0x9c, osccal).hz();
        assert!((hz(0x9c) - 8e6).abs() < 1.0);
        assert!(hz(0x9d) > hz(0x9c) && hz(0x80) < hz(0x7f));
    }
}
