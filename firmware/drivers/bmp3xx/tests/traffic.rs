//! The traffic on the bus, compared with that of crazyflie-firmware 2a18fc29
//! (sensors_bmi088_bmp3xx.c and Bosch's driver in it).

use bittybuzz_bmp3xx::{Address, Barometer, BarometerCounts, Error, Model};
use bittybuzz_testbus::{BusError, Event, TestDelay, Wires, run};

use crate::chip::{ADDRESS, Bench, CALIBRATIONS, Defect};

#[test]
fn the_chip_starts_as_in_bitcrazes_firmware() {
    let wires = Wires::new();
    let mut bench = Bench::new(&wires, Defect::None);
    bench.start().unwrap();
    let events = wires.take_events();
    let write = |bytes: &[u8]| Event::write(ADDRESS, bytes);
    let start = [
        Event::read(ADDRESS, &[0x00], &[0x50]),
        Event::read(ADDRESS, &[0x03], &[0x10]),
        write(&[0x7e, 0xb6]),
        Event::wait_us(2_000),
        Event::read(ADDRESS, &[0x02], &[0x00]),
        Event::read(ADDRESS, &[0x31], &CALIBRATIONS[0]),
        write(&[0x1c, 0x03]),
        write(&[0x1d, 0x02]),
        write(&[0x1f, 0x04]),
        // Bitcraze's driver sets the mode in a second transaction.
        write(&[0x1b, 0x33]),
        Event::read(ADDRESS, &[0x02], &[0x00]),
    ];
    assert_eq!(events[..start.len()], start);
    let is_reading = |event: &Event| !event.is_write();
    assert!(events[start.len()..].iter().all(is_reading), "the configuration is read back");
}

#[test]
fn both_models_are_known() {
    for (id, model) in [(0x50, Model::Bmp388), (0x60, Model::Bmp390)] {
        let mut bench = Bench::new(&Wires::new(), Defect::Id(id));
        assert_eq!(bench.start().unwrap().model(), model);
    }
}

#[test]
fn a_sample_is_one_transaction() {
    let wires = Wires::new();
    let mut bench = Bench::new(&wires, Defect::None);
    bench.chip.borrow_mut().file.counts = [0x01_02_03, 0xf4_f5_f6];
    let barometer = bench.start().unwrap();
    wires.take_events();
    let sample = run(barometer.read(&mut bench.bus)).unwrap();
    let counts = BarometerCounts { pressure: 0x01_02_03, temperature: 0xf4_f5_f6 };
    assert_eq!((sample.counts, sample.is_new), (counts, false));
    let bytes = [0x10, 0x03, 0x02, 0x01, 0xf6, 0xf5, 0xf4];
    assert_eq!(wires.take_events(), [Event::read(ADDRESS, &[0x03], &bytes)]);
}

#[test]
fn a_sample_is_new_once() {
    let wires = Wires::new();
    let mut bench = Bench::new(&wires, Defect::None);
    let barometer = bench.start().unwrap();
    let mut new = 0;
    for _ in 0..100 {
        run(embedded_hal_async::delay::DelayNs::delay_ms(&mut bench.delay, 10));
        new += u32::from(run(barometer.read(&mut bench.bus)).unwrap().is_new);
    }
    assert!((49..=51).contains(&new), "{new} samples in a second");
}

#[test]
fn the_other_address_is_reached() {
    let wires = Wires::new();
    let mut bench = Bench::new(&wires, Defect::None);
    let mut delay = TestDelay(wires.clone());
    let start = Barometer::start(&mut bench.bus, &mut delay, Address::SdoLow);
    assert_eq!(run(start), Err(Error::Bus(BusError::Nack)));
    assert_eq!(wires.take_events(), [Event::write(0x76, &[])], "nobody answers at 0x76");
}
