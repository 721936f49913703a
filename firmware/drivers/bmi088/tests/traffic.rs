//! The traffic on the bus, compared with that of crazyflie-firmware 2a18fc29
//! (sensors_bmi088_bmp3xx.c and Bosch's driver in it).

use bittybuzz_bmi088::{
    AccelerationCounts, Accelerometer, Address, DataReady, Gyroscope, RateCounts,
};
use bittybuzz_testbus::{Event, TestDelay, Wires, run};

use crate::chips::{ACCELEROMETER, Defect, GYROSCOPE, Imu};

/// Returns the writes among events.
fn writes(events: &[Event]) -> Vec<Event> {
    events.iter().filter(|event| event.is_write()).cloned().collect()
}

#[test]
fn the_gyroscope_starts_as_in_bitcrazes_firmware() {
    let wires = Wires::new();
    let mut imu = Imu::new(&wires, Defect::None);
    let mut delay = TestDelay(wires.clone());
    run(Gyroscope::start(&mut imu.bus, &mut delay, Address::SdoHigh, DataReady::Int3)).unwrap();
    let events = wires.take_events();
    assert_eq!(events[0], Event::read(GYROSCOPE, &[0x00], &[0x0f]), "the identity comes first");
    // Bitcraze's driver does not reset the chip, and relies on the range and the power mode after a
    // reset; it reads 0x16 (0x0f after a reset) and changes two bits of it.
    let write = |bytes: [u8; 2]| Event::write(GYROSCOPE, &bytes);
    let added = [write([0x14, 0xb6]), write([0x0f, 0x00]), write([0x11, 0x00])];
    let bitcraze =
        [write([0x10, 0x02]), write([0x15, 0x80]), write([0x16, 0x0d]), write([0x18, 0x01])];
    let (ours, theirs): (Vec<Event>, Vec<Event>) =
        writes(&events).into_iter().partition(|event| added.contains(event));
    assert_eq!(theirs, bitcraze);
    assert_eq!(ours, added);
    assert_eq!(events.last(), Some(&Event::wait_us(50_000)));
    let waits: u32 = events.iter().map(|e| if let Event::Wait(ns) = e { *ns } else { 0 }).sum();
    assert_eq!(waits, 80_000_000, "the documentation says 80 ms");
    let gyroscope = imu.gyroscope.borrow();
    let values = &gyroscope.file.values;
    assert_eq!((values[0x0f], values[0x10], values[0x11]), (0, 2, 0));
}

#[test]
fn the_accelerometer_starts_as_in_bitcrazes_firmware() {
    let wires = Wires::new();
    let mut imu = Imu::new(&wires, Defect::None);
    let mut delay = TestDelay(wires.clone());
    run(Accelerometer::start(&mut imu.bus, &mut delay, Address::SdoLow)).unwrap();
    let events = wires.take_events();
    let write = |bytes: &[u8]| Event::write(ACCELEROMETER, bytes);
    let start = [
        Event::read(ACCELEROMETER, &[0x00], &[0x1e]),
        // Bitcraze's driver does not reset the chip.
        write(&[0x7e, 0xb6]),
        Event::wait_us(1_000),
        write(&[0x7d, 0x04]),
        Event::wait_us(5_000),
        write(&[0x7c, 0x00, 0x04]),
        Event::wait_us(10_000),
        // A change of 0xa8, the value after a reset, in Bitcraze's driver.
        write(&[0x40, 0x8c]),
        write(&[0x41, 0x03]),
    ];
    assert_eq!(events[..start.len()], start);
    assert!(writes(&events[start.len()..]).is_empty(), "only the configuration is read back");
    let accelerometer = imu.accelerometer.borrow();
    let values = &accelerometer.file.values;
    assert_eq!((values[0x40], values[0x41]), (0x8c, 0x03), "the chip took its configuration");
}

#[test]
fn a_sample_is_one_transaction_per_chip() {
    let wires = Wires::new();
    let mut imu = Imu::new(&wires, Defect::None);
    let mut delay = TestDelay(wires.clone());
    let (rate, acceleration) = run(async {
        let bus = &mut imu.bus;
        let gyroscope =
            Gyroscope::start(bus, &mut delay, Address::SdoHigh, DataReady::Int3).await.unwrap();
        let accelerometer = Accelerometer::start(bus, &mut delay, Address::SdoLow).await.unwrap();
        wires.take_events();
        (gyroscope.read(bus).await.unwrap(), accelerometer.read(bus).await.unwrap())
    });
    assert_eq!(rate, RateCounts([0x0201, 0x0403, -0x79fb]));
    assert_eq!(acceleration, AccelerationCounts([0x0102, 0x0304, -0x0506]));
    let expected = [
        Event::read(GYROSCOPE, &[0x02], &[1, 2, 3, 4, 5, 0x86]),
        Event::read(ACCELEROMETER, &[0x12], &[0x02, 0x01, 0x04, 0x03, 0xfa, 0xfa]),
    ];
    assert_eq!(wires.take_events(), expected);
}

#[test]
fn the_pin_of_data_ready_can_be_chosen() {
    // Registers 0x15, 0x16 and 0x18 (data sheet, 5.5.8 to 5.5.10).
    let pins = [
        (DataReady::Off, [0x00, 0x0f, 0x00]),
        (DataReady::Int3, [0x80, 0x0d, 0x01]),
        (DataReady::Int4, [0x80, 0x07, 0x80]),
    ];
    for (pin, expected) in pins {
        let wires = Wires::new();
        let mut imu = Imu::new(&wires, Defect::None);
        let mut delay = TestDelay(wires.clone());
        run(Gyroscope::start(&mut imu.bus, &mut delay, Address::SdoHigh, pin)).unwrap();
        let gyroscope = imu.gyroscope.borrow();
        let values = &gyroscope.file.values;
        assert_eq!([values[0x15], values[0x16], values[0x18]], expected, "{pin:?}");
    }
}

#[test]
fn self_tests_leave_a_chip_as_after_a_reset() {
    let wires = Wires::new();
    let mut imu = Imu::new(&wires, Defect::None);
    let mut delay = TestDelay(wires.clone());
    run(async {
        Gyroscope::self_test(&mut imu.bus, &mut delay, Address::SdoHigh).await.unwrap();
        Accelerometer::self_test(&mut imu.bus, &mut delay, Address::SdoLow).await.unwrap();
    });
    assert_eq!(imu.gyroscope.borrow().file.values[0x16], 0x0f);
    assert_eq!(imu.accelerometer.borrow().file.values[0x7c], 0x03);
    assert_eq!(imu.accelerometer.borrow().file.values[0x6d], 0x00);
    let events = wires.take_events();
    assert!(events.contains(&Event::wait_us(3_000)), "more than 2 ms before the first force");
    let forces: Vec<Event> = writes(&events)
        .into_iter()
        .filter(|event| matches!(event, Event::I2c { written, .. } if written[0] == 0x6d))
        .collect();
    let write = |force| Event::write(ACCELEROMETER, &[0x6d, force]);
    assert_eq!(forces, [write(0x0d), write(0x09), write(0x00)]);
}
