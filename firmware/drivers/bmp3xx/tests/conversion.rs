//! The compensation, compared with exact arithmetic.
//!
//! The expected values were computed with Python's fractions from the formulas with real
//! numbers, and the same program computed Bosch's integer formulas
//! (BMP3-Sensor-API, bmp3.c without BMP3_FLOAT_COMPENSATION). Both agree within the resolution of
//! the integers: 0.01 °C, and 0.02 Pa.

use bittybuzz_bmp3xx::BarometerCounts;
use bittybuzz_testbus::Wires;

use crate::chip::{Bench, Defect};

/// A pair of counts for pressure and temperature; the exact temperature and pressure; Bosch's
/// integers, divided by 100.
type Line = ([u32; 2], [f64; 2], [f64; 2]);

const LINES: [[Line; 6]; 2] = [
    [
        ([6_500_000, 8_300_000], [22.1025, 98_875.032], [22.1, 98_875.03]),
        ([7_300_000, 8_400_000], [23.8564, 85_782.329], [23.85, 85_782.32]),
        ([6_700_000, 7_600_000], [9.8046, 92_453.523], [9.8, 92_453.52]),
        ([9_200_000, 8_600_000], [27.3623, 54_334.084], [27.36, 54_334.08]),
        ([5_200_000, 6_400_000], [-11.3583, 110_943.344], [-11.35, 110_943.34]),
        ([6_000_000, 11_200_000], [72.6796, 120_929.467], [72.67, 120_929.46]),
    ],
    [
        ([6_500_000, 8_300_000], [23.8666, 105_275.221], [23.86, 105_275.21]),
        ([7_300_000, 8_400_000], [25.5824, 92_633.895], [25.58, 92_633.89]),
        ([6_700_000, 7_600_000], [11.8421, 99_073.634], [11.84, 99_073.63]),
        ([9_200_000, 8_600_000], [29.0125, 62_256.817], [29.01, 62_256.81]),
        ([5_200_000, 6_400_000], [-8.8280, 116_913.303], [-8.82, 116_913.3]),
        ([6_000_000, 11_200_000], [73.4227, 126_994.495], [73.42, 126_994.49]),
    ],
];

#[test]
fn the_compensation_is_exact_to_a_twentieth_of_a_pascal() {
    for (number, lines) in LINES.into_iter().enumerate() {
        let mut bench = Bench::new(&Wires::new(), Defect::None);
        bench.chip.borrow_mut().file.calibration = number;
        let barometer = bench.start().unwrap();
        for ([pressure, temperature], exact, integers) in lines {
            let air = barometer.air(BarometerCounts { pressure, temperature });
            let found = [f64::from(air.temperature_celsius), f64::from(air.pressure_pa)];
            assert!((found[0] - exact[0]).abs() < 0.0002, "{found:?} {exact:?}");
            assert!((found[1] - exact[1]).abs() < 0.05, "{found:?} {exact:?}");
            assert!((found[0] - integers[0]).abs() < 0.02, "{found:?} {integers:?}");
            assert!((found[1] - integers[1]).abs() < 0.06, "{found:?} {integers:?}");
        }
    }
}

#[test]
fn a_barometer_is_small() {
    assert_eq!(size_of::<bittybuzz_bmp3xx::Barometer>(), 60, "as the documentation says");
}
