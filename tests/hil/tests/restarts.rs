//! Faults of scripts on the robots' images: the robot goes on, and the script starts again.

use std::time::Duration;

use bittybuzz_comms::infrared::{self, FaultReport};
use bittybuzz_hil::kilobots::behavior;
use bittybuzz_hil::{
    Command, Core, EmulatorEvent, Kilobots, ScriptFile, Swarm, Table, TraceLog, time, trace,
};
use bittybuzz_vm_core::FaultCode;

/// Robot 1 divides by zero in its fifth step, again and again. The others log the number of their neighbors.
const FRAGILE: &str = "\
function init() { n = 0 neighbors.listen(\"x\", function(topic, value, robot) { }) }
function step() {
  n = n + 1
  led(2)
  if(id == 1) { if(n == 5) n = n / 0 }
  else log(neighbors.count())
}
";

/// Robot 2 sends what the listener of robot 1 cannot add.
const POISONED: &str = "\
function init() {
  n = 0
  sum = 0
  neighbors.listen(\"x\", function(topic, value, robot) {
    sum = sum + value
  })
}
function step() {
  n = n + 1
  if(id == 2) neighbors.broadcast(\"x\", nil)
  log(n)
}
";

/// Two of the robot's neighbors forget it after three seconds without a message: in the pause from 4.5 to 8.5 s it sends some.
const IN_PAUSE_MS: u64 = 8_400;

fn restarts(trace_log: &TraceLog) -> Vec<&str> {
    let records = trace_log.records.iter().map(String::as_str);
    records.filter(|record| record.starts_with("Restart")).collect()
}

const RESTARTS: [&str; 5] = [
    "Restart { step: 4, pause: 10 }",
    "Restart { step: 4, pause: 0 }",
    "Restart { step: 8, pause: 20 }",
    "Restart { step: 8, pause: 0 }",
    "Restart { step: 12, pause: 40 }",
];

fn has_contained_once(trace_log: &TraceLog) {
    let contained: Vec<&String> =
        trace_log.records.iter().filter(|record| record.starts_with("contained")).collect();
    assert_eq!(contained.len(), 1, "{:?}", trace_log.records);
    assert!(contained[0].contains("WrongType"), "{contained:?}");
    assert!(trace_log.unused.messages.failed >= 5, "{:?}", trace_log.unused);
    assert!(restarts(trace_log).is_empty());
    assert!(trace_log.log.len() >= 18, "the script goes on: {:?}", trace_log.log);
}

#[test]
fn a_crazyflie_starts_again_and_stays_a_neighbor() {
    let mut swarm = Swarm::crazyflies(FRAGILE, &[1, 2]);
    swarm.run_ms(IN_PAUSE_MS);
    let [first, second] = swarm.members() else { panic!("two robots") };
    assert_eq!(restarts(&first.trace_log), RESTARTS);
    assert_eq!(second.last_logged(), Some(&["1".to_owned()][..]));
}

#[test]
fn a_zooid_starts_again_and_stays_a_neighbor() {
    let mut table = Table::new(FRAGILE, &[1, 2]);
    table.run_ms(IN_PAUSE_MS);
    let [first, second] = table.zooids() else { panic!("two robots") };
    assert_eq!(restarts(&first.trace_log), RESTARTS);
    assert_eq!(second.last_logged(), Some(&["1".to_owned()][..]));
    // Red in the pause, dark at the start, then the script's color.
    let changes = |color: &str| -> Vec<(i64, bool)> {
        let events = first.events.iter().filter_map(|event| match &event.event {
            EmulatorEvent::Led { name, on } if name == color => {
                Some((event.at.as_millis() as i64, *on))
            }
            _ => None,
        });
        events.collect()
    };
    let near = |changes: &[(i64, bool)], at: i64, on: bool| {
        changes.iter().any(|(when, is_on)| (when - at).abs() <= 30 && *is_on == on)
    };
    let (red, green) = (changes("red"), changes("green"));
    for (start, fault) in [(0, 500), (1500, 2000), (4000, 4500)] {
        assert!(near(&green, start + 100, true), "{green:?}");
        assert!(near(&green, fault, false) && near(&red, fault, true), "{green:?} {red:?}");
    }
}

#[test]
fn a_listener_that_fails_on_a_crazyflie_is_reported_once() {
    let mut swarm = Swarm::crazyflies(POISONED, &[1, 2]);
    swarm.run_ms(2_000);
    has_contained_once(&swarm.members()[0].trace_log);
}

#[test]
fn a_listener_that_fails_on_a_zooid_is_reported_once() {
    let mut table = Table::new(POISONED, &[1, 2]);
    table.run_ms(2_000);
    has_contained_once(&table.zooids()[0].trace_log);
}

/// As a person sees it: the status LED, the script's own, and a motor.
#[test]
fn a_crazyflie_shows_the_fault_in_the_pause_and_no_longer() {
    let source = "function init() { n = 0 }\n\
        function step() { n = n + 1 led(2) set_motor(0, 50) if(n == 5) n = n / 0 }\n";
    let script = ScriptFile::new("restarts", source);
    let trace = trace(Core::Unicorn, script.path(), 2.4);
    let seen: Vec<(f64, f64)> =
        trace.of("restart").map(|line| (time(line), line["seconds"].as_f64().unwrap())).collect();
    for ((at, seconds), (expected_at, expected)) in
        seen.iter().zip([(0.5, 1.0), (1.5, 0.0), (2.0, 2.0)])
    {
        assert!((at - expected_at).abs() < 0.02 && *seconds == expected, "{seen:?}");
    }
    assert_eq!(seen.len(), 3);
    for (at, red, green, motor) in [
        (0.45, "off", "on", "19.5 %"),
        (0.65, "on", "on", "0.0 %"),
        (1.55, "off", "off", "0.0 %"),
        (1.85, "off", "on", "19.5 %"),
        (2.15, "on", "on", "0.0 %"),
    ] {
        assert_eq!(trace.output_at("led red_right", at), red, "at {at} s");
        assert_eq!(trace.output_at("led green_left", at), green, "at {at} s");
        let found = trace.output_at("motor 1", at);
        let is_off = found == "off" && motor == "0.0 %";
        assert!(is_off || found.starts_with(motor), "{found} at {at} s");
    }
}

const GREEN: [u8; 3] = [0, 3, 0];
const RED: [u8; 3] = [3, 0, 0];

#[test]
fn a_kilobot_starts_again_and_sends_on_in_the_pause() {
    let script = "\
function init() { n = 0 neighbors.listen(\"x\", function(topic, value, robot) { n = value }) }
function step() {
  n = n + 1
  led(2)
  if(n == 5) n = n / 0
}
";
    let mut robots = Kilobots::in_image(script, &behavior("gradient"), 1);
    let begin = robots.start();
    robots.run_ms(8_000);
    let mut colors = robots.colors(0, begin);
    // A fault is where green becomes red, a start where red becomes green.
    colors.retain(|(_, color)| [GREEN, RED].contains(color));
    colors.dedup_by_key(|(_, color)| *color);
    let times = |wanted| -> Vec<f64> {
        let of_color = colors.iter().filter(|(_, color)| *color == wanted);
        of_color.map(|(at, _)| at.as_secs_f64()).collect()
    };
    let (faults, starts) = (times(RED), times(GREEN));
    assert_eq!((faults.len(), starts.len()), (3, 3), "{colors:?}");
    // The first step comes a tick after the start.
    for (fault, start, pause) in [(faults[0], starts[1], 1.1), (faults[1], starts[2], 2.1)] {
        assert!((start - fault - pause).abs() < 0.02, "{start} - {fault}");
    }
    // In the third pause reports and beacons take turns.
    let pause = Duration::from_secs_f64(faults[2] + 0.5);
    let kinds: Vec<u8> = robots
        .sent(0)
        .into_iter()
        .filter(|(at, _)| *at > pause)
        .map(|(_, message)| infrared::opened(&message).unwrap().0)
        .collect();
    let count = |kind| kinds.iter().filter(|known| **known == kind).count();
    assert!(count(infrared::FAULT) >= 2 && count(8) >= 2, "{kinds:?}");
    assert_eq!(count(infrared::FAULT) + count(8), kinds.len(), "{kinds:?}");
    // While the script runs there is no report.
    let running = |at: &Duration| (starts[2]..faults[2]).contains(&at.as_secs_f64());
    let sent = robots.sent(0);
    let mut while_running = sent.iter().filter(|(at, _)| running(at));
    assert!(while_running.all(|(_, message)| FaultReport::of(message).is_none()));
}

#[test]
fn a_listener_that_fails_on_a_kilobot_is_reported_by_light() {
    let script = "\
function init() {
  n = 0
  neighbors.listen(\"x\", function(topic, value, robot) { n = n + value })
}
function step() {
  led(n % 2 + 1)
  n = n + 1
  if(id == 1) neighbors.broadcast(\"x\", nil)
}
";
    let mut robots = Kilobots::in_image(script, &behavior("gradient"), 2);
    robots.start();
    robots.run_ms(1_000);
    // Robots that were not placed do not see each other's light: this brings the broadcasts over.
    let (_, broadcast) = robots.sent(1)[0];
    for _ in 0..60 {
        let at = robots.now();
        robots.execute_on(0, &Command::Radio { at, payload: broadcast.to_vec() });
        robots.run_ms(500);
    }
    let reports: Vec<FaultReport> =
        robots.sent(0).iter().filter_map(|(_, message)| FaultReport::of(message)).collect();
    let contained = reports.first().expect("a report");
    assert!(contained.is_contained);
    assert_eq!(contained.fault.unwrap().code, FaultCode::WrongType);
    assert!(reports.iter().all(|report| report == contained), "{reports:?}");
    assert!(reports.len() < robots.sent(0).len() / 8, "{} reports", reports.len());
    // Red and green take turns with every step.
    let mut last = robots.colors(0, robots.now() - Duration::from_secs(1));
    last.retain(|(_, color)| [GREEN, RED].contains(color));
    assert!((9..=11).contains(&last.len()), "{last:?}");
    assert!(robots.sent(1).iter().all(|(_, message)| FaultReport::of(message).is_none()));
}

/// A person who looks at the log sees soon that the script runs again.
#[test]
fn a_script_that_restarts_reports_its_state_soon() {
    let script = "\
function init() { n = 0 }
function step() { n = n + 1 if(n == 27) n = n / 0 }
";
    let mut swarm = Swarm::crazyflies(script, &[1]);
    // The script fails in its 27th step, starts again a second later, and fails again 2.7 s after that.
    swarm.run_ms(2_600);
    let counts = |swarm: &mut Swarm| {
        let trace_log = &swarm.members()[0].trace_log;
        let reports = trace_log.firmware.iter().filter(|line| line.contains("ticks missed"));
        (restarts(trace_log).len(), reports.count())
    };
    assert_eq!(counts(&mut swarm), (0, 1));
    swarm.run_ms(1_600);
    assert_eq!(counts(&mut swarm), (2, 1));
    swarm.run_ms(2_000);
    assert_eq!(counts(&mut swarm), (2, 2));
}
