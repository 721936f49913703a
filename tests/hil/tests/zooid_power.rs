//! Zooids whose power goes and comes, and links that do.

use std::collections::BTreeSet;
use std::time::Duration;

use bittybuzz_hil::{Command, Core, Place, Table, is_lit, poll_of, resets};

/// Logs its number and how many robots it hears, shines and drives.
const SCRIPT: &str = "\
function init() { n = 0 }
function step() {
  n = n + 1
  neighbors.broadcast(\"n\", n)
  led(7)
  set_motor(40, 40)
  log(n, id)
}
";

/// Numbers that were logged from a time on.
fn logged(table: &Table, robot: usize, from: usize) -> Vec<String> {
    let log = &table.zooids()[robot].trace_log.log;
    log[from..].iter().map(|(_, values)| values.join(" ")).collect()
}

fn expected(steps: usize) -> Vec<String> {
    (1..=steps).map(|n| format!("{n} 7")).collect()
}

fn is_on(table: &Table, color: &str) -> bool {
    is_lit(&table.zooids()[0].events, color)
}

#[test]
fn power_on_restarts_with_the_content_of_flash() {
    for core in [Core::Own, Core::Unicorn] {
        let mut table = Table::on(core, SCRIPT, &[7]);
        table.put(0, Place::at(0.0, 0.0, 0.0));
        table.run_ms(1050);
        assert_eq!(logged(&table, 0, 0), expected(10), "{core:?}");
        assert!(is_on(&table, "red") && table.zooids()[0].motors()[0] > 0.3);
        table.execute_on(0, &Command::Power { on: false });
        table.run_ms(10);
        let sent = table.board(0).radio_sent;
        assert!(sent >= 8, "{sent}");
        table.run_ms(2000);
        assert_eq!(table.zooids()[0].motors(), [0.0; 2], "{core:?}");
        assert!(["red", "green", "blue"].iter().all(|color| !is_on(&table, color)));
        assert_eq!(table.board(0).radio_sent, sent);
        assert_eq!(logged(&table, 0, 10), expected(0));
        table.execute_on(0, &Command::Power { on: true });
        table.run_ms(1050);
        assert_eq!(logged(&table, 0, 10), expected(10), "{core:?}");
        assert!(is_on(&table, "red") && table.zooids()[0].motors()[0] > 0.3);
        let board = table.board(0);
        assert!(board.radio_sent >= sent + 8, "{board:?}");
        assert_eq!((board.radio_too_early, board.radio_written_while_active), (0, 0));
        let causes: Vec<&str> =
            resets(&table.zooids()[0].events).into_iter().map(|(_, cause)| cause).collect();
        assert_eq!(causes, ["power_off", "power_on"]);
    }
}

#[test]
fn qemu_gives_power_too() {
    let mut table = Table::on(Core::Qemu, SCRIPT, &[7]);
    table.run_ms(250);
    table.execute_on(0, &Command::Power { on: false });
    table.run_ms(100);
    assert!(!is_on(&table, "red"));
    assert_eq!(logged(&table, 0, 0), expected(2));
    table.execute_on(0, &Command::Power { on: true });
    table.run_ms(250);
    assert_eq!(logged(&table, 0, 2), expected(2));
    assert!(is_on(&table, "red"));
}

/// A robot that has locked itself runs again, as its people are told.
#[test]
fn after_a_failure_power_on_helps() {
    let mut table = Table::new(SCRIPT, &[7]);
    table.run_ms(1000);
    let symbol = poll_of("talk");
    let application = bittybuzz_hil::table::layout().application;
    let firmware = table.read(0, application.address, application.size);
    table.execute_on(0, &Command::Skip { symbol });
    table.run_ms(2000);
    let before = table.zooids()[0].trace_log.log.len();
    assert!(before < 15, "it stands: {before}");
    // The flash is mended; that alone changes nothing.
    table.write(0, application.address, &firmware);
    table.run_ms(1000);
    assert_eq!(table.zooids()[0].trace_log.log.len(), before);
    for on in [false, true] {
        table.execute_on(0, &Command::Power { on });
    }
    table.run_ms(1050);
    assert_eq!(logged(&table, 0, before), expected(10));
}

/// In the middle of anything: the emulator and the firmware get on.
#[test]
fn power_may_go_at_any_time() {
    let mut table = Table::new(SCRIPT, &[7, 8]);
    for robot in [0, 1] {
        table.put(robot, Place::at(100.0 * robot as f64, 0.0, 0.0));
    }
    for number in 0..40_u64 {
        table.run(Duration::from_micros(20_000 + 3_517 * number));
        for on in [false, true] {
            table.execute_on(0, &Command::Power { on });
        }
    }
    let before = table.zooids()[0].trace_log.log.len();
    table.run_ms(1050);
    assert_eq!(logged(&table, 0, before), expected(10));
    // The other one has not noticed but for what it hears.
    let others = table.zooids()[1].trace_log.log.iter().map(|(_, values)| values[0].clone());
    let counted: Vec<String> = (1..=others.len()).map(|n| n.to_string()).collect();
    assert_eq!(others.collect::<Vec<_>>(), counted);
}

#[test]
fn links_can_be_cut_one_by_one_and_in_one_direction() {
    let script = "\
function init() {
  heard = {}
  neighbors.listen(\"a\", function(topic, value, robot) { heard[robot] = 1 })
}
function step() {
  log(heard[0], heard[1], heard[2])
  heard = {}
  neighbors.broadcast(\"a\", 1)
}
";
    let mut table = Table::new(script, &[0, 1, 2]);
    // Whom each robot has heard in the last second.
    let mut hears = |deaf: [&[usize]; 3]| {
        for (robot, to) in deaf.into_iter().enumerate() {
            table.execute_on(
                robot,
                &Command::Deaf { to: to.iter().copied().collect::<BTreeSet<_>>() },
            );
        }
        table.run_ms(200);
        let before: Vec<usize> =
            table.zooids().iter().map(|zooid| zooid.trace_log.log.len()).collect();
        table.run_ms(1000);
        [0, 1, 2].map(|robot| {
            let log = &table.zooids()[robot].trace_log.log[before[robot]..];
            [0, 1, 2].map(|other| log.iter().any(|(_, values)| values[other] == "1"))
        })
    };
    let (o, x) = (true, false);
    assert_eq!(hears([&[], &[], &[]]), [[x, o, o], [o, x, o], [o, o, x]]);
    assert_eq!(hears([&[2], &[], &[]]), [[x, o, x], [o, x, o], [o, o, x]]);
    assert_eq!(hears([&[1, 2], &[0], &[0]]), [[x, x, x], [x, x, o], [x, o, x]]);
    assert_eq!(hears([&[], &[], &[]]), [[x, o, o], [o, x, o], [o, o, x]]);
}
