//! Tests with the registers of ST's drivers, and with `vl53l1x-uld`, a port of ST's ULD driver.

use embedded_hal::i2c::{ErrorKind, I2c};
use vl53l1x_uld::comm::{Read, Write};
use vl53l1x_uld::{DistanceMode, IOVoltage, Polarity, RangeStatus, VL53L1X as Driver};

use super::*;
use crate::devices::test_bus::TestBus;

/// The driver's access to the bus. The driver has the interface of embedded-hal 0.2.
struct Port(TestBus<Vl53l1x>);

impl Write for Port {
    type Error = ErrorKind;

    fn write_registers(
        &mut self,
        address: u8,
        register: [u8; 2],
        bytes: &[u8],
    ) -> Result<(), ErrorKind> {
        self.0.write(address, &[&register, bytes].concat())
    }
}

impl Read for Port {
    type Error = ErrorKind;

    fn read_registers(
        &mut self,
        address: u8,
        register: [u8; 2],
        bytes: &mut [u8],
    ) -> Result<(), ErrorKind> {
        self.0.write_read(address, &register, bytes)
    }
}

fn bus() -> TestBus<Vl53l1x> {
    let bus = TestBus::new(Vl53l1x::new(DistanceScale::default(), true, Time::ZERO));
    bus.wait(Time::from_millis(2));
    bus
}

fn read<const N: usize>(bus: &mut TestBus<Vl53l1x>, register: u16) -> [u8; N] {
    let mut bytes = [0; N];
    bus.write_read(DEFAULT_ADDRESS, &register.to_be_bytes(), &mut bytes).unwrap();
    bytes
}

fn write(bus: &mut TestBus<Vl53l1x>, register: u16, bytes: &[u8]) {
    bus.write(DEFAULT_ADDRESS, &[&register.to_be_bytes(), bytes].concat()).unwrap();
}

fn set_target(bus: &TestBus<Vl53l1x>, target: RangeTarget) {
    bus.device.borrow_mut().set_target(target, bus.now.get());
}

/// Returns a driver of a sensor that it has started.
fn driver(bus: &TestBus<Vl53l1x>) -> Driver<Port> {
    let mut driver = Driver::new(Port(bus.clone()), DEFAULT_ADDRESS);
    assert!(driver.is_booted().unwrap());
    assert_eq!(driver.get_sensor_id().unwrap(), 0xeacc);
    driver.init(IOVoltage::Volt2_8).unwrap();
    driver
}

/// Waits for a result, and returns its time.
fn wait_for_result(bus: &TestBus<Vl53l1x>, driver: &mut Driver<Port>) -> Time {
    while !driver.is_data_ready().unwrap() {}
    driver.clear_interrupt().unwrap();
    bus.now.get()
}

#[test]
fn an_unmodified_driver_measures_distances() {
    let bus = bus();
    let mut driver = driver(&bus);
    driver.set_distance_mode(DistanceMode::Long).unwrap();
    driver.set_timing_budget_ms(33).unwrap();
    driver.set_inter_measurement_period_ms(33).unwrap();
    set_target(&bus, RangeTarget::Distance(1234));
    driver.start_ranging().unwrap();
    wait_for_result(&bus, &mut driver);
    assert_eq!(driver.get_range_status().unwrap(), RangeStatus::Valid);
    assert_eq!(driver.get_distance().unwrap(), 1234);
    set_target(&bus, RangeTarget::Distance(2000));
    wait_for_result(&bus, &mut driver);
    wait_for_result(&bus, &mut driver);
    let result = driver.get_result().unwrap();
    assert_eq!((result.status, result.distance_mm), (RangeStatus::Valid, 2000));
    assert_eq!((result.spad_count, result.ambient), (16, 0x10 * 8));
    driver.stop_ranging().unwrap();
    bus.wait(Time::from_millis(1_000));
    assert!(!driver.is_data_ready().unwrap());
}

/// The driver's budgets and periods.
#[test]
fn measurements_take_their_time() {
    let modes = [
        (DistanceMode::Short, [15, 20, 33, 50, 100, 200, 500].as_slice()),
        (DistanceMode::Long, &[20, 33, 50, 100, 200, 500]),
    ];
    for (mode, budgets_ms) in modes {
        let bus = bus();
        let mut driver = driver(&bus);
        driver.set_distance_mode(mode).unwrap();
        for budget_ms in budgets_ms {
            driver.set_timing_budget_ms(*budget_ms).unwrap();
            assert_eq!(driver.get_timing_budget_ms().unwrap(), *budget_ms);
            for period_ms in [*budget_ms, *budget_ms * 2] {
                driver.set_inter_measurement_period_ms(period_ms).unwrap();
                let begin = bus.now.get();
                driver.start_ranging().unwrap();
                let first = wait_for_result(&bus, &mut driver);
                let second = wait_for_result(&bus, &mut driver);
                driver.stop_ranging().unwrap();
                let is_near = |found: Time, expected_ms: u16| {
                    let expected = Time::from_millis(expected_ms.into());
                    (found - expected) + (expected - found) < Time::from_millis(2)
                };
                assert!(is_near(first - begin, *budget_ms), "{mode:?} {budget_ms}");
                assert!(is_near(second - first, period_ms), "{mode:?} {period_ms}");
            }
        }
    }
}

#[test]
fn far_surfaces_give_no_signal() {
    let cases = [
        (DistanceMode::Short, RangeTarget::Distance(1_300), true),
        (DistanceMode::Short, RangeTarget::Distance(1_301), false),
        (DistanceMode::Long, RangeTarget::Distance(4_000), true),
        (DistanceMode::Long, RangeTarget::Distance(4_001), false),
        (DistanceMode::Long, RangeTarget::NoEcho, false),
    ];
    for (mode, target, is_valid) in cases {
        let bus = bus();
        let mut driver = driver(&bus);
        driver.set_distance_mode(mode).unwrap();
        set_target(&bus, target);
        driver.start_ranging().unwrap();
        wait_for_result(&bus, &mut driver);
        let expected = if is_valid { RangeStatus::Valid } else { RangeStatus::SignalFailure };
        assert_eq!(driver.get_range_status().unwrap(), expected, "{mode:?} {target:?}");
    }
}

/// ST's full driver computes 1018 × 2011 / 2048 = 999.6.
#[test]
fn the_register_of_the_distance_has_two_readings() {
    for (scale, expected) in [(DistanceScale::Millimeters, 1000), (DistanceScale::BeforeGain, 1018)]
    {
        let bus = TestBus::new(Vl53l1x::new(scale, true, Time::ZERO));
        bus.wait(Time::from_millis(2));
        let mut driver = driver(&bus);
        set_target(&bus, RangeTarget::Distance(1000));
        driver.start_ranging().unwrap();
        wait_for_result(&bus, &mut driver);
        assert_eq!(driver.get_distance().unwrap(), expected);
    }
}

/// The start of ST's ULD driver, in the registers of Bitcraze's documents, and pin GPIO1.
#[test]
fn the_interrupt_pin_has_its_polarity() {
    let mut bus = bus();
    assert_eq!(read(&mut bus, 0x010f), [0xea, 0xcc]);
    assert_eq!(read(&mut bus, 0x00e5), [0x01]);
    for (register, value) in [(0x2d, 0), (0x2e, 1), (0x2f, 1)] {
        write(&mut bus, register, &[value]);
    }
    write(&mut bus, 0x30, &Driver::<Port>::DEFAULT_CONFIG);
    assert!(!bus.device.borrow().gpio1());
    write(&mut bus, 0x87, &[0x40]);
    let at = bus.device.borrow().next_event().unwrap();
    assert!(at - bus.now.get() <= Time::from_millis(100));
    bus.now.set(at);
    assert_eq!(read(&mut bus, 0x31), [0x03]);
    assert!(bus.device.borrow().gpio1());
    // Bit 4 is the inverse of the polarity in ST's ULD driver (VL53L1X_SetInterruptPolarity).
    write(&mut bus, 0x30, &[0x11]);
    let mut driver = Driver::new(Port(bus.clone()), DEFAULT_ADDRESS);
    assert_eq!(driver.get_interrupt_polarity().unwrap(), Polarity::ActiveLow);
    assert!(driver.is_data_ready().unwrap());
    assert!(!bus.device.borrow().gpio1());
    write(&mut bus, 0x86, &[0x01]);
    assert!(bus.device.borrow().gpio1());
    assert_eq!(read(&mut bus, 0x31), [0x03]);
}

/// Bitcraze's firmware moves each sensor to an address of its own, and XSHUT returns it to 0x29.
#[test]
fn the_address_lasts_until_xshut_is_low() {
    let mut bus = bus();
    write(&mut bus, 0x0001, &[0x2a]);
    assert!(bus.write(DEFAULT_ADDRESS, &[]).is_err());
    bus.write(0x2a, &[]).unwrap();
    bus.device.borrow_mut().set_xshut(false, bus.now.get());
    bus.wait(Time::from_millis(2));
    assert!(bus.write(0x2a, &[]).is_err() && bus.write(DEFAULT_ADDRESS, &[]).is_err());
    bus.device.borrow_mut().set_xshut(true, bus.now.get());
    assert!(bus.write(DEFAULT_ADDRESS, &[]).is_err());
    bus.wait(Time::from_millis(2));
    bus.write(DEFAULT_ADDRESS, &[]).unwrap();
}

/// ST's full driver has the modes single (0x10) and back to back (0x20), which waits for the
/// interrupt's end.
#[test]
fn other_modes_wait() {
    let mut bus = bus();
    write(&mut bus, 0x30, &Driver::<Port>::DEFAULT_CONFIG);
    for (mode, goes_on) in [(0x10, false), (0x20, true)] {
        write(&mut bus, 0x87, &[mode]);
        bus.wait(Time::from_millis(101));
        assert_eq!(read(&mut bus, 0x31), [0x03]);
        bus.wait(Time::from_millis(300));
        assert_eq!(bus.device.borrow().next_event(), None);
        write(&mut bus, 0x86, &[0x01]);
        assert_eq!(bus.device.borrow().next_event().is_some(), goes_on);
        assert_eq!(read(&mut bus, 0x31), [0x02]);
    }
}

#[test]
fn faults_change_the_chip() {
    let mut bus = bus();
    let set_fault = |fault| bus.device.borrow_mut().set_fault(Some(fault), bus.now.get());
    let mut driver = driver(&bus);
    set_target(&bus, RangeTarget::Distance(500));
    driver.start_ranging().unwrap();
    wait_for_result(&bus, &mut driver);
    set_fault(Vl53l1xFault::FrozenData);
    set_target(&bus, RangeTarget::NoEcho);
    wait_for_result(&bus, &mut driver);
    wait_for_result(&bus, &mut driver);
    assert_eq!(driver.get_distance().unwrap(), 500);
    set_fault(Vl53l1xFault::NoMeasurement);
    bus.wait(Time::from_millis(1_000));
    assert!(!driver.is_data_ready().unwrap());
    set_fault(Vl53l1xFault::WrongId(0xebaa));
    assert_eq!(driver.get_sensor_id().unwrap(), 0xebaa);
    set_fault(Vl53l1xFault::NoBoot);
    assert!(!driver.is_booted().unwrap());
    set_fault(Vl53l1xFault::NoAcknowledge);
    assert!(driver.is_booted().is_err());
    set_fault(Vl53l1xFault::SdaLow { clock_pulses: 1 });
    assert!(driver.is_booted().is_err());
    bus.device.borrow_mut().clock_pulse();
    assert!(driver.is_booted().unwrap());
    bus.write(DEFAULT_ADDRESS, &[]).unwrap();
}

/// ST's full driver expects 128 after 255 (VL53L1_update_ll_driver_rd_state), so
/// that 0 stands for the first measurement only.
#[test]
fn the_count_of_measurements_continues_at_128() {
    let mut bus = bus();
    let mut driver = driver(&bus);
    driver.set_distance_mode(DistanceMode::Short).unwrap();
    driver.set_timing_budget_ms(15).unwrap();
    driver.set_inter_measurement_period_ms(15).unwrap();
    driver.start_ranging().unwrap();
    let mut before = None;
    for _ in 0..300 {
        wait_for_result(&bus, &mut driver);
        let [count] = read(&mut bus, STREAM_COUNT);
        if let Some(before) = before {
            assert_eq!(count, if before == 255 { 128 } else { before + 1 });
        }
        before = Some(count);
    }
}
