//! Conversions, compared with figures of the data sheet and of other drivers.

use bittybuzz_bmi088::{AccelerationCounts, RateCounts};

#[test]
fn rates_have_the_sensitivity_of_the_data_sheet() {
    // 16.384 counts per °/s (5.5.2): 16,384 counts are 1000 °/s, which are 17.453293 rad/s.
    let rate = RateCounts([16_384, -16_384, 0]).rad_per_s();
    let expected = 1000f32.to_radians();
    assert!((rate.rad_per_s[0] - expected).abs() < 1e-5, "{rate:?}");
    assert!((rate.rad_per_s[1] + expected).abs() < 1e-5, "{rate:?}");
    assert_eq!(rate.rad_per_s[2], 0.0);
    // crazyflie-firmware: 4000/65536 °/s per count.
    let count = RateCounts([1, 0, 0]).rad_per_s().rad_per_s[0];
    assert!((count.to_degrees() - 4000.0 / 65536.0).abs() < 1e-8, "{count}");
}

#[test]
fn accelerations_have_the_sensitivity_of_the_data_sheet() {
    // 1,365 counts per g in Bosch's API (bmi08xa.c), which are rounded.
    let acceleration = AccelerationCounts([1_365, -1_365, 0]).m_per_s2().m_per_s2;
    assert!((acceleration[0] - 9.80665).abs() < 0.003, "{acceleration:?}");
    assert!((acceleration[1] + 9.80665).abs() < 0.003, "{acceleration:?}");
    // Linux (bmi088-accel-core.c): 0.007178 m/s² per count, with a gravity of its own.
    let count = AccelerationCounts([0, 0, 1]).m_per_s2().m_per_s2[2];
    assert!((count - 0.007178).abs() < 0.00001, "{count}");
}

#[test]
fn the_ends_of_the_ranges_convert() {
    let rate = RateCounts([i16::MIN, i16::MAX, 0]).rad_per_s().rad_per_s;
    assert!((rate[0] + 2000f32.to_radians()).abs() < 1e-4, "{rate:?}");
    assert!(rate[1] < 2000f32.to_radians(), "{rate:?}");
    let acceleration = AccelerationCounts([i16::MIN, 0, 0]).m_per_s2().m_per_s2;
    assert!((acceleration[0] + 24.0 * 9.80665).abs() < 1e-4, "{acceleration:?}");
}
