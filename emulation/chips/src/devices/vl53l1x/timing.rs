//! The duration of a measurement, and the time between two.

use crate::Time;

/// Timeouts of ST's ULD driver (registers 0x5e and 0x5f), and the duration of a measurement in
/// milliseconds (VL53L1X_SetTimingBudgetInMs).
const BUDGETS: [(u16, u64); 13] = [
    // Short distances.
    (0x001d, 15),
    (0x0051, 20),
    (0x00d6, 33),
    (0x01ae, 50),
    (0x02e1, 100),
    (0x03e1, 200),
    (0x0591, 500),
    // Long distances.
    (0x001e, 20),
    (0x0060, 33),
    (0x00ad, 50),
    (0x01cc, 100),
    (0x02d9, 200),
    (0x048f, 500),
];
/// The time that a measurement takes in addition to its two timeouts: before the first, between
/// both, and four loops of calibration (LOWPOWER_AUTO_* of ST's full driver).
const GUARD_MICROS: f64 = 4_528.0;
/// ST's ULD driver multiplies a period in milliseconds by the calibration of the oscillator and by
/// this factor (VL53L1X_SetInterMeasurementInMs).
const PERIOD_FACTOR: f64 = 1.075;

/// Returns the duration of a measurement. Other timeouts than those of the ULD driver are counted
/// in macro periods of 2304 periods of the laser, as in ST's full driver
/// (VL53L1_calc_macro_period_us).
///
/// # Parameters
/// `timeout_a`: registers 0x5e and 0x5f.
/// `laser_period_a`: register 0x60.
/// `fast_oscillator`: registers 0x06 and 0x07, the frequency in MHz divided by 4096.
pub(super) fn duration(timeout_a: u16, laser_period_a: u8, fast_oscillator: u16) -> Time {
    if let Some((_, millis)) = BUDGETS.iter().find(|(code, _)| *code == timeout_a) {
        return Time::from_millis(*millis);
    }
    // The timeout is a mantissa of eight bits with an exponent.
    let [exponent, mantissa] = timeout_a.to_be_bytes();
    let macro_periods = f64::from(mantissa) * 2.0_f64.powi(exponent.into()) + 1.0;
    // The PLL has 64 times the frequency of the oscillator.
    let pll_mhz = f64::from(fast_oscillator.max(1)) / 4096.0 * 64.0;
    let laser_clocks = (f64::from(laser_period_a) + 1.0) * 2.0;
    let timeout_micros = macro_periods * 2304.0 * laser_clocks / pll_mhz;
    // A conversion to an integer limits the number.
    Time::from_nanos(((2.0 * timeout_micros + GUARD_MICROS) * 1e3) as u64)
}

/// Returns the time from the begin of a measurement to that of the next.
///
/// # Parameters
/// `code`: registers 0x6c to 0x6f.
/// `calibration`: registers 0xde and 0xdf.
pub(super) fn period(code: u32, calibration: u16) -> Time {
    let millis = f64::from(code) / (f64::from(calibration & 0x3ff).max(1.0) * PERIOD_FACTOR);
    // A conversion to an integer limits the number.
    Time::from_nanos((millis * 1e6) as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A budget of 50 ms by ST's full driver with the oscillator's 0xbccc: (50000 − 4528) / 2 µs
    /// are 232.9 macro periods of 97.6 µs, code 0x00e8.
    #[test]
    fn other_timeouts_count_macro_periods() {
        let found = duration(0x00e8, 0x0f, 0xbccc);
        let expected = Time::from_millis(50);
        assert!((expected - found) + (found - expected) < Time::from_micros(150), "{found:?}");
        // The same with an exponent: 2 × 116 + 1.
        assert_eq!(duration(0x0174, 0x0f, 0xbccc), found);
    }
}
