//! Every error of the driver.

use bittybuzz_bmi088::{Accelerometer, Address, Axis, DataReady, Error, Gyroscope};
use bittybuzz_testbus::{BusError, TestDelay, Wires, check_failures, run};

use crate::chips::{Defect, Imu};

type Outcome<T> = Result<T, Error<BusError>>;

fn start_gyroscope(wires: &Wires, defect: Defect) -> Outcome<Gyroscope> {
    let mut imu = Imu::new(wires, defect);
    let mut delay = TestDelay(wires.clone());
    run(Gyroscope::start(&mut imu.bus, &mut delay, Address::SdoHigh, DataReady::Int3))
}

fn start_accelerometer(wires: &Wires, defect: Defect) -> Outcome<Accelerometer> {
    let mut imu = Imu::new(wires, defect);
    run(Accelerometer::start(&mut imu.bus, &mut TestDelay(wires.clone()), Address::SdoLow))
}

fn test_gyroscope(wires: &Wires, defect: Defect) -> Outcome<()> {
    let mut imu = Imu::new(wires, defect);
    run(Gyroscope::self_test(&mut imu.bus, &mut TestDelay(wires.clone()), Address::SdoHigh))
}

fn test_accelerometer(wires: &Wires, defect: Defect) -> Outcome<()> {
    let mut imu = Imu::new(wires, defect);
    run(Accelerometer::self_test(&mut imu.bus, &mut TestDelay(wires.clone()), Address::SdoLow))
}

#[test]
fn a_failed_transaction_ends_the_call() {
    let count = check_failures(|wires| start_gyroscope(wires, Defect::None), Error::Bus);
    assert_eq!(count, 15, "identity, reset, pins, and six registers written and read");
    let count = check_failures(|wires| start_accelerometer(wires, Defect::None), Error::Bus);
    assert_eq!(count, 11);
    assert!(check_failures(|wires| test_gyroscope(wires, Defect::None), Error::Bus) > 10);
    assert_eq!(check_failures(|wires| test_accelerometer(wires, Defect::None), Error::Bus), 17);
}

#[test]
fn a_chip_that_does_not_answer_is_an_error_of_the_bus() {
    let wires = Wires::new();
    let mut imu = Imu::new(&wires, Defect::None);
    let mut delay = TestDelay(wires.clone());
    let other = Gyroscope::start(&mut imu.bus, &mut delay, Address::SdoLow, DataReady::Off);
    assert_eq!(run(other), Err(Error::Bus(BusError::Nack)));
}

#[test]
fn another_chip_is_refused_before_anything_is_written() {
    // The identities of a BMI085 and of a BMI270.
    for found in [0x1f, 0x24] {
        let wires = Wires::new();
        let error = Err(Error::WrongId { found });
        assert_eq!(start_gyroscope(&wires, Defect::Id(found)), error.map(|()| unreachable!()));
        assert_eq!(start_accelerometer(&wires, Defect::Id(found)).map(|_| ()), error);
        assert_eq!(test_gyroscope(&wires, Defect::Id(found)), error);
        assert_eq!(test_accelerometer(&wires, Defect::Id(found)), error);
        assert!(!wires.take_events().iter().any(|event| event.is_write()));
    }
}

#[test]
fn each_register_of_the_configuration_is_read_back() {
    for (register, found) in [(0x0f, 1), (0x10, 0x83), (0x11, 0x80), (0x15, 0), (0x18, 0)] {
        let result = start_gyroscope(&Wires::new(), Defect::Stuck(register, found));
        let register = register as u8;
        assert_eq!(result.map(|_| ()), Err(Error::ConfigurationRefused { register, found }));
    }
    for (register, found) in
        [(0x7c, 3), (0x7d, 0), (0x40, 0xa8), (0x41, 1), (0x02, 0x04), (0x02, 1)]
    {
        let result = start_accelerometer(&Wires::new(), Defect::Stuck(register, found));
        let register = register as u8;
        assert_eq!(result.map(|_| ()), Err(Error::ConfigurationRefused { register, found }));
    }
}

#[test]
fn a_pin_that_stays_active_low_is_refused() {
    for pin in [DataReady::Int3, DataReady::Int4] {
        let wires = Wires::new();
        let mut imu = Imu::new(&wires, Defect::Stuck(0x16, 0x00));
        let mut delay = TestDelay(wires.clone());
        let start = Gyroscope::start(&mut imu.bus, &mut delay, Address::SdoHigh, pin);
        let refused = Error::ConfigurationRefused { register: 0x16, found: 0x00 };
        assert_eq!(run(start), Err(refused), "{pin:?}");
    }
}

#[test]
fn the_self_test_of_the_gyroscope_fails_or_hangs() {
    assert_eq!(test_gyroscope(&Wires::new(), Defect::None), Ok(()));
    let failed = test_gyroscope(&Wires::new(), Defect::TestFails);
    assert_eq!(failed, Err(Error::GyroscopeTestFailed));
    let wires = Wires::new();
    assert_eq!(test_gyroscope(&wires, Defect::TestHangs), Err(Error::Timeout));
    assert!(wires.now().nanos() < 200_000_000, "{:?}", wires.now());
}

#[test]
fn the_self_test_of_the_accelerometer_names_the_axis() {
    assert_eq!(test_accelerometer(&Wires::new(), Defect::None), Ok(()));
    // A g has 1,365.33 counts. The sign does not matter.
    for (number, axis, enough, too_little) in [
        (0, Axis::X, 683, 682),
        (1, Axis::Y, -683, 682),
        (2, Axis::Z, 342, 341),
        (2, Axis::Z, 342, 0),
    ] {
        let passed = test_accelerometer(&Wires::new(), Defect::Force(number, enough));
        assert_eq!(passed, Ok(()));
        let failed = test_accelerometer(&Wires::new(), Defect::Force(number, too_little));
        let difference_counts = 2 * i32::from(too_little);
        assert_eq!(failed, Err(Error::AccelerometerTestFailed { axis, difference_counts }));
    }
}
