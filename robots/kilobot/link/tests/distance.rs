//! The conversion from amplitudes to distances, with tables like those in a robot's EEPROM.

use bittybuzz_kilobot::calibration;
use bittybuzz_kilobot::distance::{Amplitudes, Gain, distance};

/// Readings that decrease with the square of the distance, like light. They were not measured on a
/// robot, since no such table has been published.
fn reading(gap: f64, gain: f64) -> f64 {
    (gain / (gap + 20.0).powi(2)).min(1023.0)
}

const HIGH: f64 = 2.0e6;
const LOW: f64 = 2.5e5;

fn table(gain: f64) -> impl Fn(u8) -> u16 {
    move |index| reading(5.0 * f64::from(index), gain) as u16
}

fn of(high_gain: f64, low_gain: f64) -> Option<u8> {
    let received = Amplitudes { high_gain: high_gain as u16, low_gain: low_gain as u16 };
    distance(received, |gain, index| match gain {
        Gain::High => table(HIGH)(index),
        Gain::Low => table(LOW)(index),
    })
}

/// The formula of kilolib in floating point.
fn line(reading: f64, table: impl Fn(u8) -> u16) -> f64 {
    let index = (1..14).find(|index| reading > f64::from(table(*index))).unwrap_or(13);
    let (here, before) = (f64::from(table(index)), f64::from(table(index - 1)));
    5.0 * f64::from(index) + 5.0 * (reading - here) / (here - before)
}

#[test]
fn distances_within_the_tables_are_accurate_to_two_mm() {
    for tenth in 0..650 {
        let gap = f64::from(tenth) / 10.0;
        let is = f64::from(of(reading(gap, HIGH), reading(gap, LOW)).unwrap());
        assert!((is - 33.0 - gap).abs() <= 2.0, "{gap} mm between rims: {is}");
    }
}

#[test]
fn the_distance_is_the_formula_rounded_towards_the_table() {
    for high in 160..700 {
        let is = f64::from(of(f64::from(high), 0.0).unwrap());
        let exact = 33.0 + line(f64::from(high), table(HIGH));
        assert!((is - exact).abs() < 1.0, "{high}: {is}, {exact}");
    }
    // In the middle of the range of both gains, the result is in the middle between both.
    let high = 800.0;
    let low = 400.0;
    let middle = (line(high, table(HIGH)) + line(low, table(LOW))) / 2.0;
    let is = f64::from(of(high, low).unwrap());
    assert!((is - 33.0 - middle).abs() <= 1.0, "{is}, {middle}");
}

#[test]
fn the_ends() {
    assert_eq!(of(1023.0, 1023.0), Some(33), "touching");
    // Beyond its last entry, the table of the high gain is extrapolated, and that of the low gain
    // means 90 mm.
    let high_gain = table(HIGH);
    let last = f64::from(high_gain(13));
    assert!(of(last / 2.0, 0.0).unwrap() > 33 + 65);
    assert_eq!(of(950.0, 0.0), Some(33 + 90));
}

#[test]
fn an_uncalibrated_robot_measures_no_distance() {
    let erased = |gain, index| calibration::entry(gain, index, |_| 0xff);
    for high_gain in 0..1024 {
        let received = Amplitudes { high_gain, low_gain: 300 };
        assert_eq!(distance(received, erased), None);
    }
}

/// Arbitrary readings and tables cause no overflow.
#[test]
fn any_numbers() {
    let values = [0, 1, 2, 134, 700, 701, 899, 900, 1023, 1024, 32_767, 32_768, 65_535];
    for first in values {
        for second in values {
            let table = |_, index: u8| if index.is_multiple_of(2) { first } else { second };
            for high_gain in values {
                for low_gain in values {
                    let received = Amplitudes { high_gain, low_gain };
                    let mm = distance(received, table);
                    assert!(mm.is_none_or(|mm| mm >= 33));
                }
            }
        }
    }
}

#[test]
fn tables_are_stored_with_the_high_byte_first() {
    let byte = |at: u16| if at == 0x22 { 3 } else { (at & 0xff) as u8 };
    assert_eq!(calibration::entry(Gain::Low, 1, byte), 0x0323);
    assert_eq!(calibration::entry(Gain::High, 0, byte), 0x5051);
    assert_eq!(calibration::entry(Gain::High, 13, byte), 0x6a6b);
}
