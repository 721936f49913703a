//! A debug probe that comes and goes next to a Crazyflie: probe-rs leaves the log's channel blocking, and then nothing reads it.

#![allow(clippy::unwrap_used, reason = "a test may")]

use std::time::Duration;

use bittybuzz_chips::Random;
use bittybuzz_hil::{Command, Event, Swarm, resets};

/// Drives, sends and logs in each step; half a second of it fills the robot's buffer.
const SCRIPT: &str = "\
function init() { n = 0 }
function step() {
  n = n + 1
  neighbors.broadcast(\"n\", n)
  set_motor(0, 20 + n % 2)
  k = 0
  while(k < LINES) { log(n, k, 1, 2, 3, 4)  k = k + 1 }
}
";
const LINES: u64 = 12;
/// Steps between two status messages, which are two.
const STATUS_STEPS: u64 = 100;

fn pull_the_cable(times: u32, seed: u64) {
    let mut swarm = Swarm::crazyflies(&SCRIPT.replace("LINES", &LINES.to_string()), &[7]);
    swarm.run_ms(1000);
    let mut now = 1000;
    let mut random = Random::new(seed);
    for _ in 0..times {
        for (attached, ms) in [(true, 0), (false, 700)] {
            swarm.members()[0].robot.tell(&Command::Probe { attached });
            let ms = ms + random.bits() % 1000;
            swarm.run_ms(ms);
            now += ms;
        }
    }
    swarm.members()[0].robot.tell(&Command::Probe { attached: true });
    // Long enough for a status message, and to 50 ms after a step.
    let rest = STATUS_STEPS * 100 + 150 - now % 100;
    swarm.run_ms(rest);
    let steps = (now + rest) / 100;
    let member = &swarm.members()[0];
    assert_eq!(resets(&member.robot.events), []);
    assert_eq!(member.told.records, Vec::<String>::new());
    let log: Vec<(Duration, u64)> =
        member.told.log.iter().map(|(at, values)| (*at, values[0].parse().unwrap())).collect();
    for (at, step) in &log {
        let late = at.as_secs_f64() - *step as f64 * 0.1;
        assert!((0.0..0.05).contains(&late), "step {step} at {at:?}");
    }
    assert_eq!(log.last().unwrap().1, steps, "the trace goes on");
    let status = member.told.firmware.iter().rfind(|line| line.contains("ticks missed"));
    assert!(status.unwrap().contains(", 0 ticks missed"), "{status:?}");
    // Of each message that is missing the robot reports that it is.
    let missing = steps * LINES - log.len() as u64;
    let most = missing + 2 * (steps / STATUS_STEPS);
    let lost = member.told.lost;
    println!("{times} pulls: {missing} of {} lines missing, {lost} messages lost", steps * LINES);
    assert!(missing >= u64::from(times) && (missing..=most).contains(&lost), "{missing} {lost}");
    // Each step has sent a packet, and has set the motor anew.
    let count = |is_meant: fn(&Event) -> bool| {
        member.robot.events.iter().filter(|event| is_meant(&event.event)).count() as u64
    };
    let sent = count(|event| matches!(event, Event::P2p { .. }));
    let set = count(|event| matches!(event, Event::Motor { number: 1, .. }));
    assert!((steps - 2..=steps).contains(&sent), "{sent} packets in {steps} steps");
    assert!((steps - 2..=steps + 2).contains(&set), "{set} set-points in {steps} steps");
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
