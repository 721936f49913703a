//! What goes wrong on a Zooid, and that it stands then.

use std::time::Duration;

use bittybuzz_emulation::message::Memory;
use bittybuzz_hil::table::{Zooid, zooids};
use bittybuzz_hil::{Command, EmulatorEvent, Place, Table, address_in, poll_of, resets};
use bittybuzz_vm_core::FaultCode;

/// When the red LED went on.
fn red(zooid: &Zooid) -> Vec<Duration> {
    let events = zooid.events.iter();
    let on = events.filter_map(|event| match &event.event {
        EmulatorEvent::Led { name, on: true } if name == "red" => Some(event.at),
        _ => None,
    });
    on.collect()
}

/// A script that drives, and a table on which it may.
fn driving(script: &str) -> Table {
    let mut table = Table::new(script, &[7]);
    table.put(0, Place::at(0.0, 0.0, 0.0));
    table
}

#[test]
fn a_failed_assert_stops_the_motors_and_blinks_its_number() {
    let script = "function init() { n = 0 }\nfunction step() { set_motor(40, 40)  n = n + 1  assert(n != 10) }";
    let mut table = driving(script);
    table.run_ms(950);
    assert!(table.zooids()[0].motors()[0] > 0.3);
    table.run_ms(150);
    assert_eq!(table.zooids()[0].motors(), [0.0; 2]);
    let record = &table.zooids()[0].trace_log.records;
    assert!(!record.is_empty(), "it told of it");
    // Two rounds: as many blinks, and a pause of 1.2 s before the first comes again.
    table.run_ms(20_000);
    let blinks = red(&table.zooids()[0]);
    let first = blinks.windows(2).position(|pair| pair[1] - pair[0] > Duration::from_secs(1));
    let number = first.unwrap() + 1;
    assert_eq!(number, FaultCode::AssertFailed as usize);
    for (index, pair) in blinks.windows(2).enumerate() {
        let pause = if (index + 1) % number == 0 { 1600 } else { 400 };
        let apart = (pair[1] - pair[0]).as_millis() as i64;
        assert!((apart - pause).abs() < 20, "{apart} ms after blink {index}");
    }
}

/// 500 ms after the last step that was completed; the radio still hears.
#[test]
fn a_step_that_never_ends_stops_the_motors_only() {
    let script = "function init() { n = 0 }\nfunction step() { set_motor(40, 40)  n = n + 1  while(n == 10) n = 10 }";
    let mut table = driving(script);
    table.run_ms(1400);
    assert!(table.zooids()[0].motors()[0] > 0.3);
    table.run_ms(150);
    assert_eq!(table.zooids()[0].motors(), [0.0; 2]);
    let before = table.board(0).radio_received;
    for number in 0..50_u64 {
        table.radio(
            table.now() + Duration::from_millis(10 * number + 1),
            &[0xb0, 9, 0, 8, number as u8],
        );
    }
    table.run_ms(1000);
    assert_eq!(table.board(0).radio_received - before, 50);
    assert_eq!(resets(&table.zooids()[0].events), []);
}

/// Whichever task dies, the watchdog restarts the robot, and no script runs until power-on.
#[test]
fn a_dead_task_ends_the_script() {
    for (task, name) in [
        ("talk", "Radio"),
        ("sense", "Sensors"),
        ("shine", "Leds"),
        ("drive_motors", "Motors"),
        ("run_script", "Script"),
    ] {
        let mut table = driving("function step() { set_motor(40, 40)  log(1) }");
        table.run_ms(1000);
        assert!(table.zooids()[0].motors()[0] > 0.3);
        let killed = table.now();
        let symbol = poll_of(task);
        table.execute_on(0, &Command::Skip { symbol });
        table.run_ms(1500);
        let zooid = &table.zooids()[0];
        let (at, cause) = *resets(&zooid.events).first().expect("a reset");
        assert_eq!(cause, "independent_watchdog", "{task}");
        // 250 ms at the watchdog's nominal frequency, and a look before and after.
        assert!((at - killed).as_millis() <= 451, "{task}: {:?}", at - killed);
        assert_eq!(zooid.motors(), [0.0; 2], "{task}");
        assert!(zooid.trace_log.log.iter().all(|(logged, _)| *logged < at), "{task}: it ran again");
        let log = &zooid.trace_log.firmware;
        let named: Vec<&str> =
            log.iter().filter_map(|line| line.strip_prefix("no sign of life from task ")).collect();
        assert!(!named.is_empty() && named.iter().all(|named| *named == name), "{task}: {log:?}");
    }
}

/// The chip's oscillators are as the data sheet allows from the next power-on.
fn power_on_with(table: &mut Table, lsi_hz: u64, crystal: bool) {
    let memory = Memory::Kept;
    table.execute_on(0, &Command::Chip { lsi_hz, crystal, memory, seed: 0, debugger: false });
    table.execute_on(0, &Command::Power { on: false });
    table.execute_on(0, &Command::Power { on: true });
}

/// A robot whose crystal is dead restarts without end, with its motors off, and shows that by its LED.
#[test]
fn a_dead_crystal_is_shown() {
    let mut table = driving("function step() { set_motor(40, 40) }");
    power_on_with(&mut table, 40_000, false);
    table.run_ms(2000);
    let zooid = &table.zooids()[0];
    let watchdog = |(_, cause): &&(Duration, &str)| *cause == "independent_watchdog";
    assert!(resets(&zooid.events).iter().filter(watchdog).count() >= 5, "{:?}", zooid.events);
    assert_eq!(zooid.motors(), [0.0; 2]);
    assert!(!red(zooid).is_empty());
}

/// Neither end of the watchdog's oscillator resets a robot that works, nor lets one that does not turn its wheels for long.
#[test]
fn the_watchdog_is_right_on_every_chip() {
    for lsi_hz in [30_000, 50_000] {
        let mut table = driving("function step() { set_motor(40, 40) }");
        power_on_with(&mut table, lsi_hz, true);
        table.run_ms(3000);
        assert!(table.zooids()[0].motors()[0] > 0.3, "{lsi_hz}");
        let begun = resets(&table.zooids()[0].events).len();
        let killed = table.now();
        let symbol = poll_of("shine");
        table.execute_on(0, &Command::Skip { symbol });
        table.run_ms(1000);
        let resets = resets(&table.zooids()[0].events);
        let (at, cause) = resets[begun];
        assert_eq!(cause, "independent_watchdog");
        // 333 ms at 30 kHz, and a look before and after.
        assert!((at - killed).as_millis() <= 534, "{lsi_hz}: {:?}", at - killed);
    }
}

/// After a mistake of the program, a fault of the processor or a full stack the motors lose their power before anything else, the
/// chip restarts, and no script runs.
#[test]
fn a_failure_takes_the_motors_power_first() {
    let task = address_in(&zooids(), &poll_of("shine"));
    let handler = address_in(&zooids(), "rust_begin_unwind") | 1;
    // `ldr r0, [pc, #0]`, `bx r0` and the address, at an address that is a multiple of four (ARMv6-M A6.7.27).
    let mut panic = vec![0x4800, 0x4700, handler as u16, (handler >> 16) as u16];
    if !task.is_multiple_of(4) {
        panic.insert(0, 0xbf00);
    }
    let failures = [
        ("panic", panic),
        // `udf #0`
        ("hard fault", vec![0xde00]),
        // `push {r0-r7, lr}`, `b .-2`
        ("full stack", vec![0xb5ff, 0xe7fd]),
    ];
    for (name, code) in failures {
        // Each wheel in one direction: two inputs of the bridges have power.
        let mut table = driving("function step() { set_motor(40, -40)  log(1) }");
        table.run_ms(1000);
        assert!(table.zooids()[0].motors() != [0.0; 2]);
        let original = table.read(0, task, 2 * code.len() as u32);
        let code: Vec<u8> = code.iter().flat_map(|half: &u16| half.to_le_bytes()).collect();
        table.write(0, task, &code);
        for _ in 0..1000 {
            table.run(Duration::from_micros(100));
            if !resets(&table.zooids()[0].events).is_empty() {
                break;
            }
        }
        table.write(0, task, &original);
        let events = &table.zooids()[0].events;
        let (at, cause) = *resets(events).first().unwrap_or_else(|| panic!("{name}: no reset"));
        assert_eq!(cause, "software", "{name}");
        let mut inputs = [0.0; 4];
        for event in events.iter().filter(|event| event.at < at) {
            if let EmulatorEvent::Motor { number, duty, .. } = event.event {
                inputs[usize::from(number) - 1] = duty;
            }
        }
        assert_eq!(inputs, [0.0; 4], "{name}: a motor has power until the reset");
        table.run_ms(1000);
        let zooid = &table.zooids()[0];
        assert_eq!(zooid.motors(), [0.0; 2], "{name}");
        assert!(zooid.trace_log.log.iter().all(|(logged, _)| *logged < at), "{name}: it ran again");
    }
}
