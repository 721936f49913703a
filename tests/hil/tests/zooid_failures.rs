//! What goes wrong on a Zooid, and that it stands then.

#![allow(clippy::unwrap_used, reason = "a test may")]

use std::time::Duration;

use bittybuzz_hil::table::Zooid;
use bittybuzz_hil::{Command, Event, Place, Table, resets};
use bittybuzz_vm_core::FaultCode;

/// When the red LED went on.
fn red(zooid: &Zooid) -> Vec<Duration> {
    let events = zooid.events.iter();
    let on = events.filter_map(|event| match &event.event {
        Event::Led { name, on: true } if name == "red" => Some(event.at),
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
    let record = &table.zooids()[0].told.records;
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
    for task in ["talk", "sense", "shine", "drive_motors", "run_script"] {
        let mut table = driving("function step() { set_motor(40, 40)  log(1) }");
        table.run_ms(1000);
        assert!(table.zooids()[0].motors()[0] > 0.3);
        let killed = table.now();
        let symbol = format!("__{task}_task_inner_function::{{closure#0}}>>::poll");
        table.tell(0, &Command::Skip { symbol });
        table.run_ms(1500);
        let zooid = &table.zooids()[0];
        let (at, cause) = *resets(&zooid.events).first().expect("a reset");
        assert_eq!(cause, "independent_watchdog", "{task}");
        // 250 ms at the watchdog's nominal frequency, and a look before and after.
        assert!((at - killed).as_millis() <= 451, "{task}: {:?}", at - killed);
        assert_eq!(zooid.motors(), [0.0; 2], "{task}");
        assert!(zooid.told.log.iter().all(|(logged, _)| *logged < at), "{task}: it ran again");
    }
}
