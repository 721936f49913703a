//! Every error of the driver.

use bittybuzz_bmp3xx::{Air, Barometer, Error};
use bittybuzz_testbus::{BusError, Wires, check_failures, run};
use embedded_hal_async::delay::DelayNs;

use crate::chip::{Bench, Defect};

fn start(wires: &Wires, defect: Defect) -> Result<Barometer, Error<BusError>> {
    Bench::new(wires, defect).start()
}

/// Starts a chip without a defect, and then tests it with a defect.
fn self_test(wires: &Wires, defect: Defect) -> Result<Air, Error<BusError>> {
    let mut bench = Bench::new(wires, Defect::None);
    let barometer = bench.start()?;
    // The chip has measured before.
    run(bench.delay.delay_ms(100));
    bench.chip.borrow_mut().file.defect = defect;
    run(barometer.self_test(&mut bench.bus, &mut bench.delay))
}

#[test]
fn a_failed_transaction_ends_the_call() {
    assert_eq!(check_failures(|wires| start(wires, Defect::None), Error::Bus), 14);
    assert!(check_failures(|wires| self_test(wires, Defect::None), Error::Bus) > 17);
}

#[test]
fn another_chip_is_refused_before_anything_is_written() {
    // The identity of a BMP280.
    let wires = Wires::new();
    assert_eq!(start(&wires, Defect::Id(0x58)), Err(Error::WrongId { found: 0x58 }));
    assert!(!wires.take_events().iter().any(|event| event.is_write()));
}

#[test]
fn a_chip_that_takes_no_command_is_an_error() {
    let wires = Wires::new();
    assert_eq!(start(&wires, Defect::Stuck(0x03, 0x00)), Err(Error::Timeout));
    assert!((10_000_000..20_000_000).contains(&wires.now().nanos()), "{:?}", wires.now());
    let refused = start(&Wires::new(), Defect::Stuck(0x02, 0x02));
    assert_eq!(refused, Err(Error::CommandRefused { found: 0x02 }));
}

#[test]
fn each_register_of_the_configuration_is_read_back() {
    for (register, found) in [(0x1b, 0x03), (0x1c, 0x02), (0x1d, 0x00), (0x1f, 0x00), (0x02, 0x04)]
    {
        let result = start(&Wires::new(), Defect::Stuck(register, found));
        let register = register as u8;
        assert_eq!(result, Err(Error::ConfigurationRefused { register, found }));
    }
}

#[test]
fn the_self_test_finds_each_defect() {
    let air = self_test(&Wires::new(), Defect::None).unwrap();
    assert!((air.pressure_pa - 98_875.03).abs() < 0.1, "{air:?}");
    let damaged = self_test(&Wires::new(), Defect::Calibration);
    assert!(matches!(damaged, Err(Error::CalibrationDamaged { stored: 0x3e, computed: _ })));
    let broken = self_test(&Wires::new(), Defect::Stuck(0x02, 0x01));
    assert_eq!(broken, Err(Error::Broken { found: 0x01 }));
    let wires = Wires::new();
    assert_eq!(self_test(&wires, Defect::Silent), Err(Error::Timeout));
    assert!(wires.now().nanos() < 300_000_000, "{:?}", wires.now());
    // The highest byte of a count that makes the pressure too high or too low, or the temperature.
    for (register, byte) in [(0x06, 0x18), (0x06, 0xff), (0x09, 0xc0), (0x09, 0x38)] {
        let implausible = self_test(&Wires::new(), Defect::Stuck(register, byte));
        assert!(matches!(implausible, Err(Error::Implausible(_))), "{register} {implausible:?}");
    }
}
