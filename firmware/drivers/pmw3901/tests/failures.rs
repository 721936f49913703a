//! Every error of the driver.

use bittybuzz_pmw3901::{Error, FlowSensor};
use bittybuzz_testbus::{BusError, Wires, check_failures, run};

use crate::chip::{Bench, Defect};

fn start(wires: &Wires, defect: Defect) -> Result<FlowSensor, Error<BusError>> {
    Bench::new(wires, defect).start()
}

#[test]
fn a_failed_transaction_ends_the_call() {
    // The select line, 9 readings, the reset and 76 registers.
    assert_eq!(check_failures(|wires| start(wires, Defect::None), Error::Bus), 87);
    let reading = |wires: &Wires| {
        let mut bench = Bench::new(wires, Defect::None);
        let sensor = bench.start()?;
        Ok(run(sensor.read(&mut bench.spi, &mut bench.delay))?)
    };
    assert_eq!(check_failures(reading, Error::Bus), 88);
}

#[test]
fn another_chip_is_refused_before_anything_is_written() {
    // No chip, whose line floats high or low, and a PMW3360.
    for (found, found_inverse) in [(0xff, 0xff), (0, 0), (0x42, 0xbd), (0x49, 0xb7)] {
        let mut bench = Bench::new(&Wires::new(), Defect::Id(found, found_inverse));
        assert_eq!(bench.start(), Err(Error::WrongId { found, found_inverse }));
        assert_eq!(bench.chip.borrow().writes, 0);
    }
}

#[test]
fn a_chip_in_another_bank_is_refused() {
    let refused = Error::ConfigurationRefused { found: 0, found_inverse: 0 };
    assert_eq!(start(&Wires::new(), Defect::StaysInBank), Err(refused));
}
