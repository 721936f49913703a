//! Tests with the traffic of Bitcraze's firmware, and with `bmp388-embedded`, an independent
//! driver.

use bmp388_embedded::{Address, Bmp388 as Driver, Error, IirFilter, OutputDataRate};
use bmp388_embedded::{Oversampling, PowerMode, SensorConfig};
use embedded_hal::i2c::I2c;

use super::*;
use crate::devices::test_bus::TestBus;

fn bus(settings: Bmp388Settings) -> TestBus<Bmp388> {
    let bus = TestBus::new(Bmp388::new(settings, Time::ZERO));
    bus.wait(Time::from_millis(1_000));
    bus
}

fn set_air(bus: &TestBus<Bmp388>, pressure_pa: f64, temperature_c: f64) {
    bus.device.borrow_mut().set_air(pressure_pa, temperature_c, bus.now.get());
}

fn set_fault(bus: &TestBus<Bmp388>, fault: Option<Bmp388Fault>) {
    bus.device.borrow_mut().set_fault(fault, bus.now.get());
}

/// Carries out the start of Bitcraze's firmware (sensors_bmi088_bmp3xx.c, bmp3.c).
fn start(bus: &mut TestBus<Bmp388>) {
    assert!([0x50, 0x60].contains(&bus.registers::<1>(ADDRESS, 0x00)[0]));
    assert_eq!(bus.registers::<1>(ADDRESS, 0x03)[0] & 0x10, 0x10);
    bus.write(ADDRESS, &[0x7e, 0xb6]).unwrap();
    bus.wait(Time::from_millis(2));
    assert_eq!(bus.registers::<1>(ADDRESS, 0x02)[0] & 0x02, 0);
    assert_eq!(bus.registers(ADDRESS, 0x31), CALIBRATION_OF_A_BMP390);
    // Pairs of a register and its value.
    bus.write(ADDRESS, &[0x1b, 0x03]).unwrap();
    bus.write(ADDRESS, &[0x1c, 0x03, 0x1d, 0x02, 0x1f, 0x04]).unwrap();
    bus.write(ADDRESS, &[0x1b, 0x33]).unwrap();
    assert_eq!(bus.registers::<1>(ADDRESS, 0x02)[0] & 0x04, 0);
}

fn raw(bus: &mut TestBus<Bmp388>) -> [u32; 2] {
    let bytes: [u8; 6] = bus.registers(ADDRESS, 0x04);
    [0, 3].map(|at| u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], 0]))
}

#[test]
fn starts_as_the_firmware_starts_it() {
    let mut bus = bus(Bmp388Settings::default());
    set_air(&bus, 98_370.55, 25.770_746);
    start(&mut bus);
    assert_eq!(bus.registers(ADDRESS, 0x1b), [0x33, 0x03, 0x02, 0x00, 0x04]);
    assert_eq!(bus.registers(ADDRESS, 0x03), [0x10]);
    bus.wait(Time::from_millis(20));
    assert_eq!(bus.registers(ADDRESS, 0x03), [0x70]);
    // The raw values of a real chip: see calibration.rs.
    let [pressure, temperature] = raw(&mut bus);
    assert!(pressure.abs_diff(0x6b_b3cb) <= 2 && temperature.abs_diff(0x82_bad1) <= 1);
    assert_eq!(bus.registers(ADDRESS, 0x03), [0x10]);
}

/// 50 Hz, and a filter of coefficient 3: a quarter of a step remains to be followed each time.
#[test]
fn measurements_have_their_rate_and_pass_the_filter() {
    let mut bus = bus(Bmp388Settings::default());
    set_air(&bus, 100_000.0, 20.0);
    start(&mut bus);
    bus.wait(Time::from_millis(100));
    let [before, _] = raw(&mut bus);
    set_air(&bus, 99_000.0, 20.0);
    let mut steps = Vec::new();
    for _ in 0..4 {
        bus.wait(Time::from_millis(20));
        steps.push(raw(&mut bus)[0]);
    }
    let end = bus.device.borrow().calibration.raw_pressure(99_000.0, 20.0);
    let share = |raw: u32| f64::from(raw - before) / f64::from(end - before);
    for (step, expected) in steps.into_iter().zip([0.25, 0.4375, 0.578_125, 0.683_593_75]) {
        assert!((share(step) - expected).abs() < 1e-3);
    }
}

/// Two threads of Bosch's forum, "BMP388 OSR (OVERSAMPLING)" of 2024-05-24 and that of user 17149:
/// with 200 Hz, both ×2 and the reset value ×4 cause an error of configuration, and PWR_CTRL
/// returns from 0x33 to 0x03. ×1 works.
#[test]
fn too_many_samples_for_the_rate_are_an_error() {
    for (osr, error, power) in [(0x00, 0x00, 0x33), (0x01, 0x04, 0x03), (0x02, 0x04, 0x03)] {
        let mut bus = bus(Bmp388Settings::default());
        bus.write(ADDRESS, &[0x1c, osr]).unwrap();
        bus.write(ADDRESS, &[0x1b, 0x33]).unwrap();
        assert_eq!(bus.registers(ADDRESS, 0x1b), [power]);
        assert_eq!(bus.registers(ADDRESS, 0x02), [error]);
        // Reading the register clears it.
        assert_eq!(bus.registers(ADDRESS, 0x02), [0x00]);
    }
}

#[test]
fn registers_have_their_reset_values() {
    let mut bus = bus(Bmp388Settings { chip: BarometerType::Bmp390, ..Default::default() });
    assert_eq!(bus.registers(ADDRESS, 0x00), [0x60, 0x01, 0x00, 0x10]);
    assert_eq!(bus.registers(ADDRESS, 0x04), [0x00, 0x00, 0x80, 0x00, 0x00, 0x80]);
    assert_eq!(bus.registers(ADDRESS, 0x15), [0x01, 0x00, 0x02, 0x02, 0x02, 0x00, 0x00, 0x02]);
    // The event of power-on is cleared when it is read.
    assert_eq!(bus.registers(ADDRESS, 0x10), [0x01]);
    assert_eq!(bus.registers(ADDRESS, 0x10), [0x00]);
    bus.write(ADDRESS, &[0x7e, 0x12]).unwrap();
    assert_eq!(bus.registers(ADDRESS, 0x02), [0x02]);
}

/// A thread of Bosch's forum (user 2664): the low bytes of pressure and temperature are zero with
/// one sample.
#[test]
fn the_resolution_follows_the_number_of_samples() {
    let mut bus = bus(Bmp388Settings::default());
    set_air(&bus, 98_370.55, 25.770_746);
    for (osr, mask) in [(0x00, 0xff), (0x03, 0x1f)] {
        bus.write(ADDRESS, &[0x1d, 0x03, 0x1c, osr, 0x1b, 0x13]).unwrap();
        bus.wait(Time::from_millis(30));
        let [pressure, temperature] = raw(&mut bus);
        assert_eq!((pressure & mask, temperature & 0xff), (0, 0));
        // A single measurement ends in sleep mode.
        assert_eq!(bus.registers(ADDRESS, 0x1b), [0x03]);
    }
}

#[test]
fn an_unmodified_driver_reads_the_air() {
    for chip in [BarometerType::Bmp388, BarometerType::Bmp390] {
        let bus = bus(Bmp388Settings { chip, ..Default::default() });
        let mut driver = Driver::new(bus.clone(), bus.clone(), Address::Secondary).unwrap();
        let config = SensorConfig {
            pressure_oversampling: Oversampling::X8,
            temperature_oversampling: Oversampling::X1,
            iir_filter: IirFilter::Coeff3,
            output_data_rate: OutputDataRate::Hz50,
        };
        driver.set_sensor_config(config).unwrap();
        for (pressure_pa, temperature_c) in
            [(101_325.0, 15.0), (95_000.0, 30.0), (30_000.0, -40.0), (125_000.0, 85.0)]
        {
            set_air(&bus, pressure_pa, temperature_c);
            driver.set_power_control(true, true, PowerMode::Normal).unwrap();
            // The filter needs some measurements.
            bus.wait(Time::from_millis(1_500));
            let found = driver.sensor_data().unwrap();
            assert!((found.pressure - pressure_pa).abs() < 0.05, "{found:?}");
            assert!((found.temperature - temperature_c).abs() < 0.001, "{found:?}");
            driver.check_errors().unwrap();
        }
        driver.soft_reset().unwrap();
        set_air(&bus, 100_000.0, 20.0);
        let found = driver.forced_measurement().unwrap();
        assert!((found.pressure - 100_000.0).abs() < 1.0, "{found:?}");
        set_fault(&bus, Some(Bmp388Fault::FatalError));
        assert!(matches!(driver.check_errors(), Err(Error::FatalError)));
    }
}

#[test]
fn faults_change_the_chip() {
    let mut bus = bus(Bmp388Settings::default());
    start(&mut bus);
    bus.wait(Time::from_millis(100));
    let before = raw(&mut bus);
    set_air(&bus, 90_000.0, 30.0);
    for (fault, status) in [(Bmp388Fault::FrozenData, 0x70), (Bmp388Fault::NoMeasurement, 0x10)] {
        set_fault(&bus, Some(fault));
        bus.wait(Time::from_millis(100));
        assert_eq!(bus.registers(ADDRESS, 0x03), [status]);
        assert_eq!(raw(&mut bus), before);
    }
    set_fault(&bus, Some(Bmp388Fault::CommandNotReady));
    assert_eq!(bus.registers::<1>(ADDRESS, 0x03)[0] & 0x10, 0);
    set_fault(&bus, Some(Bmp388Fault::WrongId(0x58)));
    assert!(matches!(
        Driver::new(bus.clone(), bus.clone(), Address::Secondary),
        Err(Error::InvalidChipId(0x58))
    ));
    set_fault(&bus, Some(Bmp388Fault::NoAcknowledge));
    assert!(bus.write(ADDRESS, &[0x00]).is_err());
    set_fault(&bus, Some(Bmp388Fault::SdaLow { clock_pulses: 3 }));
    for _ in 0..3 {
        assert!(bus.write(ADDRESS, &[0x00]).is_err());
        bus.device.borrow_mut().clock_pulse();
    }
    bus.write(ADDRESS, &[0x00]).unwrap();
}
