//! A debug probe that comes and goes: probe-rs leaves the log's channel blocking, and then nobody reads.

#![allow(clippy::unwrap_used, reason = "a test may")]

use std::time::Duration;

use bittybuzz_chips::Random;
use bittybuzz_hil::{Command, Event, Place, Table, resets};

/// Drives, sends and logs in each step; half a second of it fills the robot's buffer.
const SCRIPT: &str = "\
function init() { n = 0 }
function step() {
  n = n + 1
  neighbors.broadcast(\"n\", n)
  set_motor(40, 30 + n % 2)
  k = 0
  while(k < LINES) { log(n, k)  k = k + 1 }
}
";
const LINES: u64 = 5;
/// Steps between two status messages, which are two.
const STATUS_STEPS: u64 = 100;

fn pull_the_cable(times: u32, seed: u64) {
    let mut table = Table::new(&SCRIPT.replace("LINES", &LINES.to_string()), &[7]);
    table.put(0, Place::at(0.0, 0.0, 0.0));
    table.run_ms(1000);
    let mut random = Random::new(seed);
    let mut up_to = |ms: u64| Duration::from_nanos(random.bits() % (ms * 1_000_000));
    for _ in 0..times {
        table.run(up_to(700));
        table.tell(0, &Command::Probe { attached: false });
        table.run(Duration::from_millis(700) + up_to(1300));
        table.tell(0, &Command::Probe { attached: true });
    }
    // Long enough for a status message, and to 50 ms after a step.
    let rest = 100 - table.now().as_millis() as u64 % 100;
    table.run_ms(STATUS_STEPS * 100 + 150 + rest);
    let steps = table.now().as_millis() as u64 / 100;
    let sent = table.board(0).radio_sent;
    let zooid = &table.zooids()[0];
    assert_eq!(resets(&zooid.events), []);
    assert_eq!(zooid.told.records, Vec::<String>::new());
    let log: Vec<(Duration, u64)> =
        zooid.told.log.iter().map(|(at, values)| (*at, values[0].parse().unwrap())).collect();
    for (at, step) in &log {
        let late = at.as_secs_f64() - *step as f64 * 0.1;
        assert!((0.0..0.01).contains(&late), "step {step} at {at:?}");
    }
    assert_eq!(log.last().unwrap().1, steps, "the trace goes on");
    let status = zooid.told.firmware.iter().rfind(|line| line.contains("ticks missed"));
    assert!(status.unwrap().contains(", 0 ticks missed"), "{status:?}");
    // Of each message that is missing the robot says that it is.
    let missing = steps * LINES - log.len() as u64;
    let most = missing + 2 * (steps / STATUS_STEPS);
    let lost = zooid.told.lost;
    println!("{times} pulls: {missing} of {} lines missing, {lost} messages lost", steps * LINES);
    assert!(missing >= u64::from(times) && (missing..=most).contains(&lost), "{missing} {lost}");
    // Each step has sent a packet, and has set the right motor anew.
    assert!((steps - 2..=steps).contains(&sent), "{sent} packets in {steps} steps");
    let is_set = |event: &&bittybuzz_hil::TimedEvent| {
        matches!(event.event, Event::Motor { number: 3 | 4, .. })
    };
    let set = zooid.events.iter().filter(is_set).count() as u64;
    assert!((steps - 3..=steps + 5).contains(&set), "{set} set-points in {steps} steps");
}

#[test]
fn a_cable_that_is_pulled_stops_nothing() {
    pull_the_cable(10, 1);
}

#[test]
#[ignore = "soak"]
fn a_cable_that_is_pulled_a_hundred_times_stops_nothing() {
    pull_the_cable(100, 2);
}
