//! A Zooid whose battery runs down, step by step, and is charged.

use std::time::Duration;

use bittybuzz_hil::{Command, Place, Table, poll_of, resets};

const SCRIPT: &str = "\
function step() {
  led(2)
  set_motor(40, 40)
  neighbors.broadcast(\"n\", 1)
  log(battery())
}
";

fn battery(table: &mut Table, volts: f32, charging: bool) {
    table.execute_on(0, &Command::Battery { volts, charging, usb_powered: charging });
}

fn flashes(table: &Table, color: &str, since: Duration) -> Vec<(Duration, Duration)> {
    bittybuzz_hil::flashes(&table.zooids()[0].events, color, since)
}

/// Lets ten seconds pass: packets sent, steps logged, and flashes of red, each 50 ms long and so far apart.
fn ten_seconds(table: &mut Table, apart: Duration) -> (u64, usize, usize) {
    let (sent, logged) = (table.board(0).radio_sent, table.zooids()[0].trace_log.log.len());
    let since = table.now();
    table.run_ms(10_000);
    let red = flashes(table, "red", since);
    for (_, length) in &red {
        assert!(length.abs_diff(Duration::from_millis(50)) < Duration::from_millis(3), "{red:?}");
    }
    for pair in red.windows(2) {
        let span = pair[1].0 - pair[0].0;
        assert!(span.abs_diff(apart) < Duration::from_millis(3), "{red:?}");
    }
    let logged = table.zooids()[0].trace_log.log.len() - logged;
    (table.board(0).radio_sent - sent, logged, red.len())
}

fn logged_mv(table: &Table) -> f64 {
    table.zooids()[0].last_logged().unwrap()[0].parse().unwrap()
}

#[test]
fn a_battery_that_runs_down_warns_stops_and_switches_off() {
    let mut table = Table::new(SCRIPT, &[7]);
    table.put(0, Place::at(0.0, 0.0, 0.0));
    table.run_ms(2000);
    // Motors that start pull the voltage down for a moment.
    battery(&mut table, 2.9, false);
    table.run_ms(3500);
    battery(&mut table, 3.45, false);
    let (sent, steps, red) = ten_seconds(&mut table, Duration::ZERO);
    assert!(sent >= 98 && steps >= 99 && red == 0, "{sent} {steps} {red}");
    assert_eq!(flashes(&table, "red", Duration::ZERO), []);

    battery(&mut table, 3.4, false);
    table.run_ms(6500);
    let (sent, steps, red) = ten_seconds(&mut table, Duration::from_secs(2));
    assert!(sent >= 98 && steps >= 99 && (4..=5).contains(&red), "{sent} {steps} {red}");
    assert!(table.zooids()[0].motors()[0] > 0.3);

    battery(&mut table, 3.25, false);
    table.run_ms(6500);
    let (sent, steps, red) = ten_seconds(&mut table, Duration::from_millis(500));
    assert!(sent >= 98 && steps >= 99 && (19..=20).contains(&red), "{sent} {steps} {red}");
    assert_eq!(table.zooids()[0].motors(), [0.0; 2]);
    // The regulator has nothing left to regulate: the supply is the battery's voltage.
    assert!((logged_mv(&table) - 3250.0).abs() < 10.0, "{}", logged_mv(&table));
    assert_eq!(flashes(&table, "green", Duration::ZERO), [], "the script's color stays");

    battery(&mut table, 2.9, false);
    table.run_ms(6500);
    assert_eq!(ten_seconds(&mut table, Duration::ZERO), (0, 0, 0));
    assert_eq!(flashes(&table, "green", Duration::ZERO).len(), 1, "dark");
    assert_eq!(table.zooids()[0].motors(), [0.0; 2]);
    // Without its load the battery recovers.
    battery(&mut table, 3.6, false);
    table.run_ms(6500);
    assert_eq!(ten_seconds(&mut table, Duration::ZERO), (0, 0, 0));
    // It has restarted, to do nothing.
    assert_eq!(resets(&table.zooids()[0].events).len(), 1);

    battery(&mut table, 3.7, true);
    table.run_ms(3000);
    battery(&mut table, 3.9, false);
    table.run_ms(1000);
    let (sent, steps, red) = ten_seconds(&mut table, Duration::ZERO);
    assert!(sent >= 98 && steps >= 99 && red == 0, "{sent} {steps} {red}");
    assert!(table.zooids()[0].motors()[0] > 0.3);
    let causes: Vec<&str> =
        resets(&table.zooids()[0].events).into_iter().map(|(_, cause)| cause).collect();
    assert_eq!(causes, ["software"; 2]);
    let firmware = &table.zooids()[0].trace_log.firmware;
    assert!(!firmware.iter().any(|line| line.contains("restarted after")), "{firmware:?}");
}

/// After a failure of the firmware no script runs until power-on: neither an empty battery nor the charger are one.
#[test]
fn the_charger_does_not_unlock_a_robot_that_has_failed() {
    let mut table = Table::new(SCRIPT, &[7]);
    table.put(0, Place::at(0.0, 0.0, 0.0));
    table.run_ms(1000);
    let application = bittybuzz_hil::table::layout().application;
    let firmware = table.read(0, application.address, application.size);
    let symbol = poll_of("talk");
    table.execute_on(0, &Command::Skip { symbol });
    table.run_ms(2000);
    table.write(0, application.address, &firmware);
    table.run_ms(1000);
    let logged = table.zooids()[0].trace_log.log.len();
    let restarts = resets(&table.zooids()[0].events).len();
    for (volts, charging) in [(2.9, false), (3.7, true), (3.9, false)] {
        battery(&mut table, volts, charging);
        table.run_ms(20_000);
        assert_eq!(table.zooids()[0].trace_log.log.len(), logged, "{volts} V");
        assert_eq!(table.zooids()[0].motors(), [0.0; 2], "{volts} V");
    }
    assert_eq!(resets(&table.zooids()[0].events).len(), restarts);
}
