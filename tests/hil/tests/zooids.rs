//! The Zooid's image, as it is flashed, on an emulated table.

#![allow(clippy::unwrap_used, reason = "a test may")]

use std::time::Duration;

use bittybuzz_hil::{Command, Event, Place, Table, resets};

/// Logs its number with every step.
const COUNT: &str = "function init() { n = 0 }\nfunction step() { n = n + 1  log(n) }";

/// Changes of one LED: when, and to what.
fn led(table: &Table, robot: usize, colour: &str) -> Vec<(Duration, bool)> {
    let events = table.zooids()[robot].events.iter();
    let changes = events.filter_map(|event| match &event.event {
        Event::Led { name, on } if name == colour => Some((event.at, *on)),
        _ => None,
    });
    changes.collect()
}

/// Numbers of a line of log.
fn numbers(values: &[String]) -> Vec<f64> {
    values.iter().map(|value| value.parse().unwrap_or(f64::NAN)).collect()
}

#[test]
fn it_boots_as_the_board_wants_it() {
    let mut table = Table::new(COUNT, &[7]);
    table.put(0, Place::at(100.0, 50.0, 30.0));
    table.run_ms(2000);
    let board = table.board(0);
    assert_eq!(board.clocks_hz, [48_000_000; 2]);
    assert_eq!((board.radio_too_early, board.radio_short_pulses), (0, 0));
    assert_eq!(board.radio_written_while_active, 0);
    assert!(board.unknown.is_empty(), "{:x?}", board.unknown);
    let zooid = &table.zooids()[0];
    assert_eq!(resets(&zooid.events), []);
    assert!(zooid.told.firmware[0].contains("BittyBuzz on zooids"), "{:?}", zooid.told.firmware);
    assert!(zooid.told.firmware.iter().any(|line| line.contains("robot id 7")));
}

#[test]
fn it_steps_ten_times_a_second() {
    let mut table = Table::new(COUNT, &[7]);
    table.run_ms(5050);
    let log = &table.zooids()[0].told.log;
    assert_eq!(log.len(), 50);
    for (number, (at, values)) in (1_u32..).zip(log) {
        assert_eq!(values[0], number.to_string());
        let late = at.as_secs_f64() - f64::from(number) * 0.1;
        assert!((0.0..0.005).contains(&late), "step {number} at {at:?}");
    }
}

#[test]
fn its_led_shows_the_scripts_colour() {
    let script = "function init() { n = 0 }\nfunction step() { n = n + 1  led(n % 8) }";
    let mut table = Table::new(script, &[7]);
    table.run_ms(1650);
    // Red is bit 0, green bit 1, blue bit 2 of a number that grows ten times a second.
    for (colour, every) in [("red", 100), ("green", 200), ("blue", 400)] {
        let changes = led(&table, 0, colour);
        assert_eq!(changes.len(), 1600 / every, "{colour}: {changes:?}");
        for pair in changes.windows(2) {
            let apart = (pair[1].0 - pair[0].0).as_millis() as i64;
            assert!((apart - every as i64).abs() <= 3, "{colour}: {apart} ms");
            assert_ne!(pair[0].1, pair[1].1);
        }
    }
}

#[test]
fn it_knows_where_it_is() {
    let script = "function step() { log(pos.x, pos.y, pos.orientation) }";
    let mut table = Table::new(script, &[7]);
    for (x, y, heading) in [
        (0.0, 0.0, 0.0),
        (100.5, 57.2, 45.0),
        (-310.0, 200.0, 170.0),
        (350.0, -220.0, -120.0),
        (-50.0, -100.0, -15.0),
    ] {
        table.put(0, Place::at(x, y, heading));
        table.run_ms(500);
        let seen = numbers(table.zooids()[0].last_logged().unwrap());
        // Half a pixel, and the angle of a pixel on the line between the diodes.
        assert!((seen[0] - x).abs() < 0.75 && (seen[1] - y).abs() < 0.75, "{seen:?}: {x}, {y}");
        let turned = (seen[2] - heading + 540.0).rem_euclid(360.0) - 180.0;
        assert!(turned.abs() < 3.0, "{seen:?}: {heading}");
    }
    table.tell(0, &Command::Remove);
    table.run_ms(500);
    assert_eq!(table.zooids()[0].last_logged().unwrap(), ["nil"; 3]);
}

#[test]
fn motors_turn_as_told_and_stop_when_it_is_blind() {
    let script = "function step() { set_motor(50, -30) }";
    let mut table = Table::new(script, &[7]);
    table.run_ms(500);
    assert_eq!(table.zooids()[0].motors(), [0.0; 2], "it does not know where it is");
    table.put(0, Place::at(0.0, 0.0, 0.0));
    table.run_ms(300);
    let motors = table.zooids()[0].motors();
    assert!((motors[0] - 0.5).abs() < 0.011 && (motors[1] + 0.3).abs() < 0.011, "{motors:?}");
    for event in &table.zooids()[0].events {
        if let Event::Motor { frequency_hz, .. } = event.event {
            assert!(frequency_hz == 0.0 || (frequency_hz - 40_000.0).abs() < 1.0, "{frequency_hz}");
        }
    }
    let blind = table.now();
    table.tell(0, &Command::Remove);
    table.run_ms(400);
    assert_eq!(table.zooids()[0].motors(), [0.0; 2]);
    let mut events = table.zooids()[0].events.iter();
    let stopped = events.rfind(|event| matches!(event.event, Event::Motor { .. }));
    let after = stopped.unwrap().at - blind;
    // The frame before may have told its position 14 ms ago.
    assert!(after < Duration::from_millis(125), "{after:?}");
}
