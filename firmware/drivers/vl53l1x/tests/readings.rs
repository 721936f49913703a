//! The results of measurements.

use bittybuzz_testbus::{Wires, run};
use bittybuzz_vl53l1x::{DEFAULT_ADDRESS, Mode, RangeFault, RangeFinder, Reading};
use embedded_hal_async::delay::DelayNs;

use crate::chip::{Bench, Defect};

/// Returns the reading of a chip whose registers hold these values.
fn reading(registers: &[(usize, u16)]) -> Reading {
    let mut bench = Bench::new(&Wires::new(), Defect::None);
    run(async {
        bench.delay.delay_ms(2).await;
        let bus = &mut bench.bus;
        let finder = RangeFinder::start(bus, &mut bench.delay, DEFAULT_ADDRESS).await.unwrap();
        finder.begin(bus, Mode::Long33Ms).await.unwrap();
        for (register, value) in registers {
            let values = &mut bench.chip.borrow_mut().file.values;
            values[*register..register + 2].copy_from_slice(&value.to_be_bytes());
        }
        bench.delay.delay_ms(40).await;
        finder.poll(bus).await.unwrap().unwrap()
    })
}

/// The registers have ST's names in vl53l1-reg 0.1.1: RESULT__RANGE_STATUS 0x0089, STREAM_COUNT
/// 0x008B, AMBIENT_COUNT_RATE_MCPS_SD0 0x0090, FINAL_CROSSTALK_CORRECTED_RANGE_MM_SD0 0x0096,
/// PEAK_SIGNAL_COUNT_RATE_CROSSTALK_CORRECTED_MCPS_SD0 0x0098.
#[test]
fn a_reading_has_the_registers_of_the_result() {
    let found =
        reading(&[(0x89, 0xe9_55), (0x8b, 0x2a_66), (0x90, 0x102), (0x96, 1234), (0x98, 0x304)]);
    let expected = Reading {
        status: 9,
        stream_count: 0x2a,
        distance_mm: 1234,
        signal_mcps_128: 0x304,
        ambient_mcps_128: 0x102,
    };
    assert_eq!(found, expected);
    assert!((found.distance().unwrap().meters - 1.234).abs() < 1e-6);
}

/// The numbers are those of the table in vl53l1x-uld 2.0.1, `RangeStatus::from`.
#[test]
fn a_status_other_than_valid_has_no_distance() {
    let faults = [
        (3, RangeFault::Hardware),
        (4, RangeFault::SignalTooWeak),
        (5, RangeFault::OutOfBounds),
        (6, RangeFault::DeviationTooLarge),
        (7, RangeFault::WrappedAround),
        (18, RangeFault::Other { status: 18 }),
        (0, RangeFault::Other { status: 0 }),
    ];
    for (status, fault) in faults {
        let found = reading(&[(0x89, status << 8), (0x96, 500)]);
        assert_eq!(found.distance(), Err(fault));
    }
}
