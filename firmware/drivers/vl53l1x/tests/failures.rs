//! Every error of the driver.

use bittybuzz_testbus::{BusError, Wires, check_failures, run};
use bittybuzz_vl53l1x::{DEFAULT_ADDRESS, Error, Mode, RangeFinder, Reading};
use embedded_hal_async::delay::DelayNs;

use crate::chip::{Bench, Defect};

type Outcome<T> = Result<T, Error<BusError>>;

fn start(wires: &Wires, defect: Defect) -> Outcome<RangeFinder> {
    let mut bench = Bench::new(wires, defect);
    run(async {
        bench.delay.delay_ms(2).await;
        RangeFinder::start(&mut bench.bus, &mut bench.delay, DEFAULT_ADDRESS).await
    })
}

/// Starts a chip without a defect, which then gets one, and takes a reading.
fn measure(wires: &Wires, defect: Defect) -> Outcome<Option<Reading>> {
    let mut bench = Bench::new(wires, Defect::None);
    run(async {
        bench.delay.delay_ms(2).await;
        let bus = &mut bench.bus;
        let finder = RangeFinder::start(bus, &mut bench.delay, DEFAULT_ADDRESS).await?;
        bench.chip.borrow_mut().file.defect = defect;
        finder.begin(bus, Mode::Long33Ms).await?;
        bench.delay.delay_ms(40).await;
        Ok(finder.poll(bus).await?)
    })
}

fn move_chip(wires: &Wires, defect: Defect, to: u8) -> Outcome<()> {
    let mut bench = Bench::new(wires, defect);
    run(async {
        bench.delay.delay_ms(2).await;
        RangeFinder::move_chip(&mut bench.bus, &mut bench.delay, DEFAULT_ADDRESS, to).await
    })
}

#[test]
fn a_failed_transaction_ends_the_call() {
    assert!(check_failures(|wires| start(wires, Defect::None), Error::Bus) > 12);
    assert!(check_failures(|wires| measure(wires, Defect::None), Error::Bus) > 30);
    assert!(check_failures(|wires| move_chip(wires, Defect::None, 0x30), Error::Bus) >= 5);
}

#[test]
fn a_chip_is_silent_before_it_is_ready() {
    let mut bench = Bench::new(&Wires::new(), Defect::None);
    let start = RangeFinder::start(&mut bench.bus, &mut bench.delay, DEFAULT_ADDRESS);
    assert_eq!(run(start), Err(Error::Bus(BusError::Nack)), "at the edge of XSHUT");
}

#[test]
fn another_chip_is_refused_before_anything_is_written() {
    // The identity of a VL53L4CD.
    let wires = Wires::new();
    let wrong = Error::WrongId { found: 0xebaa };
    assert_eq!(start(&wires, Defect::Id(0xebaa)), Err(wrong));
    assert_eq!(move_chip(&Wires::new(), Defect::Id(0xebaa), 0x30), Err(wrong));
    assert!(!wires.take_events().iter().any(|event| event.is_write()));
}

#[test]
fn waits_are_limited() {
    let wires = Wires::new();
    assert_eq!(start(&wires, Defect::NeverBoots), Err(Error::BootTimeout));
    assert!(wires.now().nanos() < 200_000_000, "{:?}", wires.now());
    let wires = Wires::new();
    assert_eq!(start(&wires, Defect::NeverMeasures), Err(Error::CalibrationTimeout));
    assert!(wires.now().nanos() < 1_500_000_000, "{:?}", wires.now());
}

#[test]
fn addresses_with_a_meaning_of_their_own_are_refused() {
    for address in [0x00, 0x07, 0x78, 0x80, 0xff] {
        let moved = move_chip(&Wires::new(), Defect::None, address);
        assert_eq!(moved, Err(Error::AddressReserved { address }));
    }
    assert_eq!(move_chip(&Wires::new(), Defect::None, 0x08), Ok(()));
    assert_eq!(move_chip(&Wires::new(), Defect::None, 0x77), Ok(()));
    let kept = move_chip(&Wires::new(), Defect::KeepsAddress, 0x30);
    assert_eq!(kept, Err(Error::Bus(BusError::Nack)), "nobody answers at the new address");
}

#[test]
fn the_configuration_is_read_back() {
    let refused = start(&Wires::new(), Defect::Stuck(0x30, 0x11));
    assert_eq!(refused, Err(Error::ConfigurationRefused { register: 0x30, found: 0x11 }));
    let cases = [
        (0x4b, 0x4b, 0x14, 0x14),
        (0x60, 0x60, 0x07, 0x07),
        (0x63, 0x63, 0x05, 0x05),
        (0x69, 0x69, 0x38, 0x38),
        (0x79, 0x78, 0x05, 0x0f05),
        (0x7a, 0x7a, 0x06, 0x060e),
        (0x5f, 0x5e, 0x51, 0x0051),
        (0x62, 0x61, 0x00, 0x0000),
        (0x6e, 0x6c, 0x00, 0x006c),
    ];
    for (stuck, register, value, found) in cases {
        let refused = measure(&Wires::new(), Defect::Stuck(stuck, value));
        assert_eq!(refused, Err(Error::ConfigurationRefused { register, found }));
    }
}

#[test]
fn an_oscillator_that_was_not_measured_is_an_error() {
    let mut bench = Bench::new(&Wires::new(), Defect::None);
    bench.chip.borrow_mut().file.values[0xde..0xe0].copy_from_slice(&[0xfc, 0x00]);
    run(async {
        bench.delay.delay_ms(2).await;
        let bus = &mut bench.bus;
        let finder = RangeFinder::start(bus, &mut bench.delay, DEFAULT_ADDRESS).await.unwrap();
        let refused = Error::ConfigurationRefused { register: 0xde, found: 0xfc00 };
        assert_eq!(finder.begin(bus, Mode::Long33Ms).await, Err(refused));
    });
}
