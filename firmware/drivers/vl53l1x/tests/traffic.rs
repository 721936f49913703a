//! The traffic on the bus, compared with that of ST's ultra-lite driver as the crate vl53l1x-uld
//! 2.0.1 has it.

use std::cell::RefCell;
use std::rc::Rc;

use bittybuzz_chips::Time;
use bittybuzz_testbus::{Event, Registers, TestDelay, TestI2c, Wires, run};
use bittybuzz_vl53l1x::{DEFAULT_ADDRESS, Mode, RangeFinder};
use embedded_hal_async::delay::DelayNs;

use crate::chip::{Bench, Defect, Model};

/// The registers 0x30 to 0x87, copied from a dump of that crate's constant and not from this one's.
const DEFAULTS: &str = "
    01 02 00 02 08 00 08 10 01 01 00 00 00 00 FF 00 0F 00 00 00 00 00 20 0B 00 00 02 0A 21 00 00 05
    00 00 00 00 C8 00 00 38 FF 01 00 08 00 00 01 CC 0F 01 F1 0D 01 68 00 80 08 B8 00 00 00 00 0F 89
    00 00 00 00 00 00 00 01 0F 0D 0E 0E 00 00 02 C7 FF 9B 00 00 00 01 00 00";

fn defaults() -> Vec<u8> {
    DEFAULTS.split_whitespace().map(|byte| u8::from_str_radix(byte, 16).unwrap()).collect()
}

/// Returns the writes among events, as bytes.
fn writes(events: Vec<Event>) -> Vec<Vec<u8>> {
    let bytes = events.into_iter().filter(Event::is_write).map(|event| match event {
        Event::I2c { written, .. } => written,
        _ => Vec::new(),
    });
    bytes.collect()
}

async fn started(bench: &mut Bench) -> RangeFinder {
    bench.delay.delay_ms(2).await;
    RangeFinder::start(&mut bench.bus, &mut bench.delay, DEFAULT_ADDRESS).await.unwrap()
}

#[test]
fn the_chip_starts_as_in_the_ultra_lite_driver() {
    let wires = Wires::new();
    run(started(&mut Bench::new(&wires, Defect::None)));
    let expected = [
        vec![0x00, 0x2d, 0x00],
        vec![0x00, 0x2e, 0x01],
        vec![0x00, 0x2f, 0x01],
        [vec![0x00, 0x30], defaults()].concat(),
        // ST's driver does not clear the interrupt here; that of Linux does.
        vec![0x00, 0x86, 0x01],
        vec![0x00, 0x87, 0x40],
        vec![0x00, 0x86, 0x01],
        vec![0x00, 0x87, 0x00],
        vec![0x00, 0x08, 0x09],
        vec![0x00, 0x0b, 0x00],
    ];
    assert_eq!(writes(wires.take_events()), expected);
}

#[test]
fn modes_have_the_registers_of_the_ultra_lite_driver() {
    // The period is 501 · milliseconds · 1.075, as four bytes.
    let modes: [(Mode, [&[u8]; 9]); 2] = [
        (
            Mode::Short20Ms,
            [
                &[0x4b, 0x14],
                &[0x60, 0x07],
                &[0x63, 0x05],
                &[0x69, 0x38],
                &[0x78, 0x07, 0x05],
                &[0x7a, 0x06, 0x06],
                &[0x5e, 0x00, 0x51],
                &[0x61, 0x00, 0x6e],
                // 10,771.5, rounded down.
                &[0x6c, 0x00, 0x00, 0x2a, 0x13],
            ],
        ),
        (
            Mode::Long33Ms,
            [
                &[0x4b, 0x0a],
                &[0x60, 0x0f],
                &[0x63, 0x0d],
                &[0x69, 0xb8],
                &[0x78, 0x0f, 0x0d],
                &[0x7a, 0x0e, 0x0e],
                &[0x5e, 0x00, 0x60],
                &[0x61, 0x00, 0x6e],
                // 17,772.975, rounded down.
                &[0x6c, 0x00, 0x00, 0x45, 0x6c],
            ],
        ),
    ];
    for (mode, registers) in modes {
        let wires = Wires::new();
        let mut bench = Bench::new(&wires, Defect::None);
        run(async {
            let finder = started(&mut bench).await;
            wires.take_events();
            finder.begin(&mut bench.bus, mode).await.unwrap();
        });
        let stop = vec![0x00, 0x87, 0x00];
        let registers = registers.iter().map(|bytes| [&[0], *bytes].concat());
        let mut expected: Vec<Vec<u8>> = [stop].into_iter().chain(registers).collect();
        expected.extend([vec![0x00, 0x86, 0x01], vec![0x00, 0x87, 0x40]]);
        assert_eq!(writes(wires.take_events()), expected, "{mode:?}");
    }
}

#[test]
fn the_chip_measures_in_the_period_of_its_mode() {
    for (mode, rate) in [(Mode::Short20Ms, 50..=51), (Mode::Long33Ms, 30..=31)] {
        let wires = Wires::new();
        let mut bench = Bench::new(&wires, Defect::None);
        let count = run(async {
            let finder = started(&mut bench).await;
            finder.begin(&mut bench.bus, mode).await.unwrap();
            let end = wires.now() + Time::from_millis(1_020);
            let mut count = 0;
            while wires.now() < end {
                bench.delay.delay_ms(1).await;
                count += u32::from(finder.poll(&mut bench.bus).await.unwrap().is_some());
            }
            finder.stop(&mut bench.bus).await.unwrap();
            bench.delay.delay_ms(100).await;
            assert_eq!(finder.poll(&mut bench.bus).await, Ok(None), "it has stopped");
            count
        });
        assert!(rate.contains(&count), "{mode:?}: {count}");
    }
}

#[test]
fn a_chip_that_measures_can_be_started_and_changed() {
    let wires = Wires::new();
    let mut bench = Bench::new(&wires, Defect::None);
    run(async {
        let finder = started(&mut bench).await;
        finder.begin(&mut bench.bus, Mode::Short20Ms).await.unwrap();
        bench.delay.delay_ms(50).await;
        // The processor was reset, but not the chip, which has an old result.
        let before = wires.now();
        let finder = started(&mut bench).await;
        let calibration = wires.now() - before;
        assert!(calibration > Time::from_millis(100), "it waits for a new measurement");
        finder.begin(&mut bench.bus, Mode::Short20Ms).await.unwrap();
        bench.delay.delay_ms(50).await;
        finder.begin(&mut bench.bus, Mode::Long33Ms).await.unwrap();
        assert_eq!(finder.poll(&mut bench.bus).await, Ok(None), "no result of the other mode");
    });
}

#[test]
fn a_look_is_one_transaction_and_a_reading_three() {
    let wires = Wires::new();
    let mut bench = Bench::new(&wires, Defect::None);
    run(async {
        let finder = started(&mut bench).await;
        finder.begin(&mut bench.bus, Mode::Long33Ms).await.unwrap();
        wires.take_events();
        assert_eq!(finder.poll(&mut bench.bus).await, Ok(None));
        assert_eq!(wires.take_events(), [Event::read(DEFAULT_ADDRESS, &[0x00, 0x31], &[0x02])]);
        bench.delay.delay_ms(40).await;
        wires.take_events();
        assert!(finder.poll(&mut bench.bus).await.unwrap().is_some());
    });
    let events = wires.take_events();
    assert_eq!(events.len(), 3);
    assert_eq!(events[0], Event::read(DEFAULT_ADDRESS, &[0x00, 0x31], &[0x03]));
    assert!(matches!(
        &events[1],
        Event::I2c { written, read, .. } if written == &[0x00, 0x89] && read.len() == 17
    ));
    assert_eq!(events[2], Event::write(DEFAULT_ADDRESS, &[0x00, 0x86, 0x01]));
}

#[test]
fn chips_are_moved_one_after_the_other() {
    let wires = Wires::new();
    let mut delay = TestDelay(wires.clone());
    let mut bus = TestI2c::new(&wires);
    let mut finders = Vec::new();
    for address in 0x30..0x36 {
        // The caller releases XSHUT of the next chip.
        let model = Model::new(Defect::None, wires.now());
        bus = bus.with(&Rc::new(RefCell::new(Registers::new(model, 2))));
        run(async {
            delay.delay_ms(2).await;
            let from = DEFAULT_ADDRESS;
            RangeFinder::move_chip(&mut bus, &mut delay, from, address).await.unwrap();
        });
    }
    for address in 0x30..0x36 {
        let finder = run(RangeFinder::start(&mut bus, &mut delay, address)).unwrap();
        run(finder.begin(&mut bus, Mode::Short20Ms)).unwrap();
        finders.push(finder);
    }
    run(delay.delay_ms(25));
    for finder in finders {
        assert!(run(finder.poll(&mut bus)).unwrap().is_some(), "{finder:?}");
    }
}
