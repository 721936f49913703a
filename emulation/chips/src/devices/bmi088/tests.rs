//! Tests whose expectations come from the data sheet, Bosch's driver and the traffic of Bitcraze's
//! firmware.

use embedded_hal::i2c::I2c;

use super::*;
use crate::devices::test_bus::TestBus;

const ACCELEROMETER: u8 = ACCELEROMETER_ADDRESS;
const GYROSCOPE: u8 = GYROSCOPE_ADDRESS;

fn bus(settings: Bmi088Settings) -> TestBus<Bmi088> {
    let bus = TestBus::new(Bmi088::new(settings, Time::ZERO));
    bus.wait(Time::from_millis(1_000));
    bus
}

/// Carries out the start of Bitcraze's firmware (sensors_bmi088_bmp3xx.c).
fn start(bus: &mut TestBus<Bmi088>) {
    let [id] = bus.registers(GYROSCOPE, 0x00);
    assert_eq!(id, 0x0f);
    bus.write(GYROSCOPE, &[0x10, 0x02]).unwrap();
    bus.write(GYROSCOPE, &[0x15, 0x80]).unwrap();
    let [pins] = bus.registers(GYROSCOPE, 0x16);
    bus.write(GYROSCOPE, &[0x16, pins & !0x02 | 0x01]).unwrap();
    bus.write(GYROSCOPE, &[0x18, 0x01]).unwrap();
    bus.wait(Time::from_millis(50));
    bus.write(ACCELEROMETER, &[0x7d, 0x04]).unwrap();
    bus.wait(Time::from_millis(5));
    let [id] = bus.registers(ACCELEROMETER, 0x00);
    assert_eq!(id, 0x1e);
    bus.write(ACCELEROMETER, &[0x7c, 0x00, 0x04]).unwrap();
    bus.wait(Time::from_millis(10));
    let [conf] = bus.registers(ACCELEROMETER, 0x40);
    bus.write(ACCELEROMETER, &[0x40, conf & 0x80 | 0x0c]).unwrap();
    bus.write(ACCELEROMETER, &[0x41, 0x03]).unwrap();
}

fn gyro(bus: &mut TestBus<Bmi088>) -> [i16; 3] {
    let bytes: [u8; 6] = bus.registers(GYROSCOPE, 0x02);
    [0, 2, 4].map(|at| i16::from_le_bytes([bytes[at], bytes[at + 1]]))
}

fn accel(bus: &mut TestBus<Bmi088>) -> [i16; 3] {
    let bytes: [u8; 6] = bus.registers(ACCELEROMETER, 0x12);
    [0, 2, 4].map(|at| i16::from_le_bytes([bytes[at], bytes[at + 1]]))
}

fn set_motion(bus: &TestBus<Bmi088>, rate: [i16; 3], force: [i16; 3]) {
    bus.device.borrow_mut().set_motion(rate, force, bus.now.get());
}

fn set_fault(bus: &TestBus<Bmi088>, fault: Bmi088Fault) {
    bus.device.borrow_mut().set_fault(Some(fault), bus.now.get());
}

/// Returns the changes of pin INT3 within a span.
fn edges(bus: &TestBus<Bmi088>, span: Time) -> Vec<(Time, Option<bool>)> {
    let end = bus.now.get() + span;
    let mut device = bus.device.borrow_mut();
    let mut found = Vec::new();
    let mut level = device.int3();
    while let Some(at) = device.next_event().filter(|at| *at <= end) {
        device.advance(at);
        if device.int3() != level {
            level = device.int3();
            found.push((at, level));
        }
    }
    bus.now.set(end);
    found
}

#[test]
fn starts_as_the_firmware_starts_it() {
    let mut bus = bus(Bmi088Settings::default());
    set_motion(&bus, [1, -2, 300], [-4, 5, 1365]);
    start(&mut bus);
    assert_eq!(bus.registers(GYROSCOPE, 0x10), [0x82]);
    assert_eq!(bus.registers(GYROSCOPE, 0x16), [0x0d]);
    // The reset value 0xa8 keeps its bit 7.
    assert_eq!(bus.registers(ACCELEROMETER, 0x40), [0x8c, 0x03]);
    assert_eq!(bus.registers(ACCELEROMETER, 0x7c), [0x00, 0x04]);
    bus.wait(Time::from_millis(2));
    assert_eq!(gyro(&mut bus), [1, -2, 300]);
    assert_eq!(accel(&mut bus), [-4, 5, 1365]);
}

#[test]
fn registers_have_their_reset_values() {
    let mut bus = bus(Bmi088Settings::default());
    assert_eq!(bus.registers(ACCELEROMETER, 0x40), [0xa8, 0x01]);
    assert_eq!(bus.registers(ACCELEROMETER, 0x7c), [0x03, 0x00]);
    assert_eq!(bus.registers(ACCELEROMETER, 0x22), [0x80, 0x00]);
    assert_eq!(bus.registers(GYROSCOPE, 0x0f), [0x00, 0x80, 0x00]);
    assert_eq!(bus.registers(GYROSCOPE, 0x15), [0x00, 0x0f, 0x00, 0x00]);
    start(&mut bus);
    // BMI08_SOFT_RESET_CMD, and the delays of Bosch's driver.
    bus.write(ACCELEROMETER, &[0x7e, 0xb6]).unwrap();
    bus.write(GYROSCOPE, &[0x14, 0xb6]).unwrap();
    assert!(bus.write(ACCELEROMETER, &[0x00]).is_err());
    bus.wait(Time::from_millis(1));
    assert_eq!(bus.registers(ACCELEROMETER, 0x40), [0xa8, 0x01]);
    assert_eq!(bus.registers(ACCELEROMETER, 0x7c), [0x03, 0x00]);
    assert!(bus.write(GYROSCOPE, &[0x00]).is_err());
    bus.wait(Time::from_millis(29));
    assert_eq!(bus.registers(GYROSCOPE, 0x15), [0x00, 0x0f, 0x00, 0x00]);
}

#[test]
fn data_ready_has_the_rate_of_the_chip() {
    for ppm in [-3_000, 0, 2_000, 9_000] {
        let settings = Bmi088Settings { gyroscope_deviation_ppm: ppm, ..Default::default() };
        let mut bus = bus(settings);
        assert_eq!(edges(&bus, Time::from_millis(10)), []);
        start(&mut bus);
        let rises =
            edges(&bus, Time::from_millis(10_000)).into_iter().filter(|e| e.1 == Some(true));
        let expected = 10_000 + ppm.min(3_000) / 100;
        assert!(rises.count().abs_diff(expected as usize) <= 1, "{ppm}");
    }
}

/// Data sheet 5.5.3: the interrupt is cleared after 280 to 400 µs.
#[test]
fn data_ready_is_a_pulse() {
    let mut bus = bus(Bmi088Settings::default());
    // Open drain and active high: the chip drives the pin low between pulses.
    assert_eq!(bus.device.borrow().int3(), Some(false));
    start(&mut bus);
    edges(&bus, Time::from_millis(1));
    let found = edges(&bus, Time::from_millis(10));
    let rise = found.iter().position(|edge| edge.1 == Some(true)).unwrap();
    let width = found[rise + 1].0 - found[rise].0;
    assert!(width >= Time::from_micros(280) && width <= Time::from_micros(400));
    assert_eq!(found[rise + 2].0 - found[rise].0, Time::from_millis(1));
    bus.wait(found[rise].0 + Time::from_millis(10) - bus.now.get());
    assert_eq!(bus.registers(GYROSCOPE, 0x0a), [0x80]);
    bus.wait(Time::from_micros(400));
    assert_eq!(bus.registers(GYROSCOPE, 0x0a), [0x00]);
    // Active low.
    bus.write(GYROSCOPE, &[0x16, 0x00]).unwrap();
    assert_eq!(bus.device.borrow().int3(), Some(true));
    // Not mapped to INT3.
    bus.write(GYROSCOPE, &[0x18, 0x80]).unwrap();
    assert_eq!(edges(&bus, Time::from_millis(10)), []);
}

/// Data sheet 5.5.2: reading a low byte locks the high byte until it is read.
#[test]
fn both_bytes_of_an_axis_belong_together() {
    let mut bus = bus(Bmi088Settings::default());
    set_motion(&bus, [0x0102, 0x0304, 0], [0; 3]);
    start(&mut bus);
    assert_eq!(bus.registers(GYROSCOPE, 0x02), [0x02]);
    set_motion(&bus, [0x1112, 0x1314, 0], [0; 3]);
    bus.wait(Time::from_millis(2));
    // Only the first axis was locked, and only once.
    assert_eq!(bus.registers(GYROSCOPE, 0x03), [0x01, 0x14, 0x13]);
    assert_eq!(bus.registers(GYROSCOPE, 0x03), [0x11]);
}

/// At any phase of the sensor's own samples.
#[test]
fn a_sampled_motion_shows_at_once() {
    let mut bus = bus(Bmi088Settings::default());
    start(&mut bus);
    for counts in 1..=10 {
        bus.device.borrow_mut().sample_motion([0; 3], [counts; 3], bus.now.get());
        assert_eq!(accel(&mut bus), [counts; 3]);
        bus.wait(Time::from_micros(130));
    }
}

#[test]
fn ranges_change_the_counts_and_saturate() {
    let mut bus = bus(Bmi088Settings::default());
    start(&mut bus);
    set_motion(&bus, [100, -20_000, 3], [100, -20_000, 3]);
    // BMI08_GYRO_RANGE_500_DPS and BMI088_ACCEL_RANGE_6G.
    bus.write(GYROSCOPE, &[0x0f, 0x02]).unwrap();
    bus.write(ACCELEROMETER, &[0x41, 0x01]).unwrap();
    bus.wait(Time::from_millis(2));
    assert_eq!(gyro(&mut bus), [400, i16::MIN, 12]);
    assert_eq!(accel(&mut bus), [400, i16::MIN, 12]);
}

#[test]
fn rates_follow_the_registers() {
    let mut bus = bus(Bmi088Settings::default());
    start(&mut bus);
    // BMI08_GYRO_BW_230_ODR_2000_HZ and BMI08_GYRO_BW_32_ODR_100_HZ.
    for (code, pulses) in [(1, 200), (3, 40), (7, 10)] {
        bus.write(GYROSCOPE, &[0x10, code]).unwrap();
        assert_eq!(edges(&bus, Time::from_micros(100_500)).len() / 2, pulses, "{code}");
    }
    // BMI08_ACCEL_ODR_100_HZ: data ready comes every 10 ms, and reading the data clears it.
    bus.write(ACCELEROMETER, &[0x40, 0xa8]).unwrap();
    bus.wait(Time::from_micros(10_100));
    assert_eq!(bus.registers(ACCELEROMETER, 0x1d), [0x80]);
    assert_eq!(bus.registers(ACCELEROMETER, 0x1d), [0x00]);
    assert_eq!(bus.registers(ACCELEROMETER, 0x03), [0x80]);
    accel(&mut bus);
    assert_eq!(bus.registers(ACCELEROMETER, 0x03), [0x00]);
    // A rate of code 13 does not exist: error code 1 in bits 4:2.
    bus.write(ACCELEROMETER, &[0x40, 0xad]).unwrap();
    assert_eq!(bus.registers(ACCELEROMETER, 0x02), [0x04]);
}

#[test]
fn suspended_parts_do_not_measure() {
    let mut bus = bus(Bmi088Settings::default());
    start(&mut bus);
    bus.wait(Time::from_millis(2));
    bus.write(GYROSCOPE, &[0x11, 0x80]).unwrap();
    // No change between suspend and deep suspend (bmi08g_set_power_mode).
    bus.write(GYROSCOPE, &[0x11, 0x20]).unwrap();
    assert_eq!(bus.registers(GYROSCOPE, 0x11), [0x80]);
    bus.write(ACCELEROMETER, &[0x7c, 0x03]).unwrap();
    bus.wait(Time::from_millis(2));
    set_motion(&bus, [7; 3], [7; 3]);
    bus.wait(Time::from_millis(100));
    assert_eq!((gyro(&mut bus), accel(&mut bus)), ([0; 3], [0; 3]));
    bus.write(GYROSCOPE, &[0x11, 0x00]).unwrap();
    bus.write(ACCELEROMETER, &[0x7c, 0x00]).unwrap();
    // BMI08_GYRO_POWER_MODE_CONFIG_DELAY is 30 ms.
    bus.wait(Time::from_millis(29));
    assert_eq!((gyro(&mut bus), accel(&mut bus)), ([0; 3], [7; 3]));
    bus.wait(Time::from_millis(2));
    assert_eq!(gyro(&mut bus), [7; 3]);
}

/// The table of data sheet 5.3.7.
#[test]
fn temperatures_have_the_code_of_the_data_sheet() {
    let table = [
        (85.0, [0x3e, 0x00]),
        (23.375, [0x00, 0x60]),
        (23.125, [0x00, 0x20]),
        (23.0, [0x00, 0x00]),
        (-40.0, [0xc1, 0x00]),
    ];
    let mut bus = bus(Bmi088Settings::default());
    start(&mut bus);
    for (temperature_c, bytes) in table {
        bus.device.borrow_mut().set_temperature_c(temperature_c, bus.now.get());
        bus.wait(Time::from_millis(1_280));
        assert_eq!(bus.registers(ACCELEROMETER, 0x22), bytes, "{temperature_c}");
    }
}

/// Data sheet 5.3.5: the counter's second byte changes every 10 ms.
#[test]
fn sensor_time_counts() {
    let mut bus = bus(Bmi088Settings::default());
    let first: [u8; 3] = bus.registers(ACCELEROMETER, 0x18);
    bus.wait(Time::from_millis(100) - Time::from_nanos(22_500 * 6));
    let second: [u8; 3] = bus.registers(ACCELEROMETER, 0x18);
    let number = |bytes: [u8; 3]| u32::from_le_bytes([bytes[0], bytes[1], bytes[2], 0]);
    assert_eq!(number(second) - number(first), 2_560);
    assert!(number(first).abs_diff(25_600) < 10);
}

/// Data sheet 4.6.1 and 5.5.11, with the order of Bosch's driver.
#[test]
fn self_tests_pass_and_fail() {
    for fault in [None, Some(Bmi088Fault::FailedSelfTest)] {
        let mut bus = bus(Bmi088Settings::default());
        start(&mut bus);
        bus.device.borrow_mut().set_fault(fault, bus.now.get());
        bus.write(ACCELEROMETER, &[0x40, 0xac]).unwrap();
        set_motion(&bus, [0; 3], [0, 0, 1365]);
        let mut response = |polarity| {
            bus.write(ACCELEROMETER, &[0x6d, polarity]).unwrap();
            bus.wait(Time::from_millis(51));
            accel(&mut bus)
        };
        let (positive, negative) = (response(0x0d), response(0x09));
        let difference_mg =
            [0, 1, 2].map(|axis| i32::from(positive[axis] - negative[axis]) * 24_000 / 32_768);
        let limits_mg = [1_000, 1_000, 1_000];
        let has_passed = difference_mg.iter().zip(limits_mg).all(|(found, limit)| *found >= limit);
        assert_eq!(has_passed, fault.is_none(), "{difference_mg:?}");
        bus.write(GYROSCOPE, &[0x3c, 0x01]).unwrap();
        let polls = (0..100).find(|_| {
            bus.wait(Time::from_millis(1));
            bus.registers::<1>(GYROSCOPE, 0x3c)[0] & 0x02 != 0
        });
        assert!(polls.is_some());
        let expected = if fault.is_none() { 0x12 } else { 0x06 };
        assert_eq!(bus.registers(GYROSCOPE, 0x3c), [expected]);
    }
}

#[test]
fn faults_of_identification_and_bus() {
    let mut bus = bus(Bmi088Settings::default());
    set_fault(&bus, Bmi088Fault::AccelerometerId(0x1f));
    assert_eq!(bus.registers(ACCELEROMETER, 0x00), [0x1f]);
    assert_eq!(bus.registers(GYROSCOPE, 0x00), [0x0f]);
    set_fault(&bus, Bmi088Fault::GyroscopeId(0));
    assert_eq!(bus.registers(GYROSCOPE, 0x00), [0]);
    set_fault(&bus, Bmi088Fault::NoAcknowledge);
    assert!(bus.write(GYROSCOPE, &[0]).is_err() && bus.write(ACCELEROMETER, &[0]).is_err());
    set_fault(&bus, Bmi088Fault::SdaLow { clock_pulses: 9 });
    for _ in 0..9 {
        assert!(bus.write(GYROSCOPE, &[0]).is_err());
        bus.device.borrow_mut().clock_pulse();
    }
    assert_eq!(bus.registers(ACCELEROMETER, 0x00), [0x1e]);
    // Another address is not the chip's.
    assert!(bus.write(0x68, &[0]).is_err());
}

#[test]
fn faults_of_data() {
    let mut bus = bus(Bmi088Settings::default());
    start(&mut bus);
    set_fault(&bus, Bmi088Fault::NoDataReady);
    edges(&bus, Time::from_millis(1));
    assert_eq!(edges(&bus, Time::from_millis(5)), []);
    set_motion(&bus, [7; 3], [7; 3]);
    bus.wait(Time::from_millis(2));
    assert_eq!(gyro(&mut bus), [7; 3]);
    bus.device.borrow_mut().set_fault(None, bus.now.get());
    edges(&bus, Time::from_millis(2));
    let [expected, ..] = edges(&bus, Time::from_millis(2))[..] else { panic!() };
    set_fault(&bus, Bmi088Fault::LateDataReady(Time::from_micros(250)));
    edges(&bus, Time::from_millis(2));
    let found = edges(&bus, Time::from_millis(2));
    let late = expected.0 + Time::from_millis(4) + Time::from_micros(250);
    assert!(found.contains(&(late, expected.1)), "{expected:?} {found:?}");
    set_fault(&bus, Bmi088Fault::FrozenData);
    set_motion(&bus, [8; 3], [8; 3]);
    assert_eq!(edges(&bus, Time::from_millis(2)).len(), 4);
    assert_eq!((gyro(&mut bus), accel(&mut bus)), ([7; 3], [7; 3]));
}
