//! A debug probe that comes and goes next to a robot: probe-rs leaves the log's channel blocking, and then nothing reads it.

use std::time::Duration;

use bittybuzz_chips::Random;
use bittybuzz_comms::syslink::SwarmFrame;
use bittybuzz_hil::{Command, EmulatorEvent, Place, Swarm, Table, TimedEvent, TraceLog, resets};

/// Drives, sends and logs in each step; half a second of it fills the robot's buffer.
const SCRIPT: &str = "\
function init() { n = 0 }
function step() {
  n = n + 1
  neighbors.broadcast(\"n\", n)
  DRIVE
  k = 0
  while(k < LINES) { LOG  k = k + 1 }
}
";

/// The robot-dependent part of the test.
struct Load {
    /// Statement that sets a motor anew in each step.
    drive: &'static str,
    /// Statement that logs a line: the step's number comes first.
    log: &'static str,
    /// Lines logged in each step.
    lines: u64,
    /// Latest moment of a step at which the lines are logged.
    late: Duration,
}

const CRAZYFLIE: Load = Load {
    drive: "set_motor(0, 20 + n % 2)",
    log: "log(n, k, 1, 2, 3, 4)",
    lines: 12,
    late: Duration::from_millis(50),
};

const ZOOID: Load = Load {
    drive: "set_motor(40, 30 + n % 2)",
    log: "log(n, k)",
    lines: 5,
    late: Duration::from_millis(10),
};

/// Period of a step.
const STEP: Duration = Duration::from_millis(100);
/// Steps between two statuses, and the most messages of one: two of the script and, of a Crazyflie, five of the
/// sensors. The first one comes early.
const STATUS_STEPS: u32 = 100;
const STATUS_MESSAGES: u64 = 7;

impl Load {
    fn script(&self) -> String {
        let script = SCRIPT.replace("DRIVE", self.drive).replace("LOG", self.log);
        script.replace("LINES", &self.lines.to_string())
    }

    /// After this many steps nothing of a pulled cable is to be seen but missing messages, at least one for each of so many
    /// `pulls`, of which the robot reports the number.
    fn assert_undisturbed(
        &self,
        trace_log: &TraceLog,
        events: &[TimedEvent],
        steps: u32,
        pulls: u32,
    ) {
        assert_eq!(resets(events), []);
        assert_eq!(trace_log.records, Vec::<String>::new());
        let step_of = |values: &[String]| values[0].parse::<u32>().unwrap();
        for (at, values) in &trace_log.log {
            let begun = step_of(values) * STEP;
            assert!((begun..begun + self.late).contains(at), "{values:?} at {at:?}");
        }
        assert_eq!(step_of(&trace_log.log.last().unwrap().1), steps, "the trace goes on");
        let status = trace_log.firmware.iter().rfind(|line| line.contains("ticks missed"));
        assert!(status.unwrap().contains(", 0 ticks missed"), "{status:?}");
        let (lines, lost) = (u64::from(steps) * self.lines, trace_log.lost);
        let missing = lines - trace_log.log.len() as u64;
        println!("{pulls} pulls: {missing} of {lines} lines missing, {lost} messages lost");
        let statuses = u64::from(steps / STATUS_STEPS) + 1;
        let most = missing + STATUS_MESSAGES * statuses;
        assert!(
            missing >= u64::from(pulls) && (missing..=most).contains(&lost),
            "{missing} {lost}"
        );
    }
}

/// Span until the test ends: long enough for a status message, and to 50 ms after a step.
fn rest(now: Duration) -> Duration {
    let since_step = Duration::from_nanos((now.as_nanos() % STEP.as_nanos()) as u64);
    (STATUS_STEPS + 1) * STEP + STEP / 2 - since_step
}

fn steps_until(now: Duration) -> u32 {
    (now.as_nanos() / STEP.as_nanos()) as u32
}

fn count(events: &[TimedEvent], is_meant: fn(&EmulatorEvent) -> bool) -> u32 {
    events.iter().filter(|event| is_meant(&event.event)).count() as u32
}

fn pull_the_cable_of_a_crazyflie(times: u32, seed: u64) {
    let mut swarm = Swarm::crazyflies(&CRAZYFLIE.script(), &[7]);
    let mut now = Duration::ZERO;
    let mut run = |swarm: &mut Swarm, ms: u64| {
        swarm.run_ms(ms);
        now += Duration::from_millis(ms);
        now
    };
    run(&mut swarm, 1000);
    let mut random = Random::new(seed);
    for _ in 0..times {
        run(&mut swarm, random.bits() % 1000);
        swarm.members()[0].robot.execute(&Command::Probe { attached: false });
        run(&mut swarm, 700 + random.bits() % 1000);
        swarm.members()[0].robot.execute(&Command::Probe { attached: true });
    }
    let now = run(&mut swarm, 0);
    swarm.run_ms(rest(now).as_millis() as u64);
    let steps = steps_until(now + rest(now));
    let member = &swarm.members()[0];
    let events = &member.robot.events;
    CRAZYFLIE.assert_undisturbed(&member.trace_log, events, steps, times);
    // Each step has sent a packet, and has set the motor anew.
    let is_message = |event: &EmulatorEvent| matches!(event, EmulatorEvent::P2p { payload, .. } if SwarmFrame::parse(payload).is_some());
    let sent = count(events, is_message);
    let set = count(events, |event| matches!(event, EmulatorEvent::Motor { number: 1, .. }));
    assert!((steps - 2..=steps).contains(&sent), "{sent} packets in {steps} steps");
    assert!((steps - 2..=steps + 2).contains(&set), "{set} set-points in {steps} steps");
}

fn pull_the_cable_of_a_zooid(times: u32, seed: u64) {
    let mut table = Table::new(&ZOOID.script(), &[7]);
    table.put(0, Place::at(0.0, 0.0, 0.0));
    table.run_ms(1000);
    let mut random = Random::new(seed);
    let mut up_to = |ms: u64| Duration::from_nanos(random.bits() % (ms * 1_000_000));
    for _ in 0..times {
        table.run(up_to(700));
        table.execute_on(0, &Command::Probe { attached: false });
        table.run(Duration::from_millis(700) + up_to(1300));
        table.execute_on(0, &Command::Probe { attached: true });
    }
    table.run(rest(table.now()));
    let steps = steps_until(table.now());
    let sent = table.board(0).radio_sent;
    let zooid = &table.zooids()[0];
    ZOOID.assert_undisturbed(&zooid.trace_log, &zooid.events, steps, times);
    // Each step has sent a packet, and has set the right motor anew.
    let set =
        count(&zooid.events, |event| matches!(event, EmulatorEvent::Motor { number: 3 | 4, .. }));
    assert!((u64::from(steps) - 2..=steps.into()).contains(&sent), "{sent} packets, {steps} steps");
    assert!((steps - 3..=steps + 5).contains(&set), "{set} set-points in {steps} steps");
}

#[test]
fn a_cable_that_is_pulled_stops_no_crazyflie() {
    pull_the_cable_of_a_crazyflie(10, 1);
}

#[test]
fn a_cable_that_is_pulled_stops_no_zooid() {
    pull_the_cable_of_a_zooid(10, 1);
}

#[test]
#[ignore = "soak"]
fn a_cable_that_is_pulled_a_hundred_times_stops_no_robot() {
    pull_the_cable_of_a_crazyflie(100, 2);
    pull_the_cable_of_a_zooid(100, 2);
}
