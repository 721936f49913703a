//! An event of each kind has its effect, at its time.

use crate::script::{folder, run_with};
use bittybuzz_arena::engine::RobotState;
use bittybuzz_arena::scenario::Scenario;
use std::path::{Path, PathBuf};

/// Counts its steps, shows the lowest bits, and counts what it hears of the other one.
const COUNTER: &str = "\
steps = 0
heard = 0
function init() { neighbors.listen(\"n\", function(topic, value, robot) { heard = heard + 1 }) }
function step() { steps = steps + 1 led(steps % 8) neighbors.broadcast(\"n\", steps) forward() }
";

/// Two Kilobots that hear each other, and what happens to them.
fn scenario(events: &str) -> String {
    format!(
        "[world]\nsize = [1000, 1000]\nduration = 30\n\
         [[robots]]\nrobot = \"kilobot\"\nscript = \"counter.bzz\"\npositions = [[-30, 0], [30, 0]]\nheading = 90\n\
         [medium.ir]\nloss = 0\n[body.kilobot]\nspeed_error = 0\nturn_error = 0\nheading_bias = 0\nheading_noise = 0\n[output]\nplot = [\"global.steps\", \"global.heard\"]\n{events}"
    )
}

fn here(test: &str) -> PathBuf {
    folder(test, &[("counter.bzz", COUNTER)])
}

/// The globals `steps` and `heard`, the place and the state of the second robot after each tick.
struct Trace {
    steps: Vec<Option<f64>>,
    received: Vec<Option<f64>>,
    places: Vec<[f32; 2]>,
    states: Vec<Option<RobotState>>,
}

fn trace(folder: &Path, events: &str) -> Trace {
    let mut trace =
        Trace { steps: Vec::new(), received: Vec::new(), places: Vec::new(), states: Vec::new() };
    run_with(folder, &scenario(events), 1, |simulation| {
        let plots = simulation.setup().plots();
        trace.steps.push(simulation.read(&plots[0], 1).number());
        trace.received.push(simulation.read(&plots[1], 1).number());
        let view = simulation.view(1);
        trace.places.push(view.map_or([f32::NAN; 2], |view| [view.pose.x, view.pose.y]));
        trace.states.push(view.map(|view| view.state));
    });
    trace
}

/// The index of the trace's entry after the tick that ends at that time.
fn at(seconds: f64) -> usize {
    (seconds * 10.0).round() as usize - 1
}

#[test]
fn scripts_step_ten_times_per_second_and_receive_messages() {
    let trace = trace(&here("no_event"), "");
    // Global code and init have the first tick.
    assert_eq!(trace.steps[at(0.1)], Some(0.0));
    assert_eq!(trace.steps[at(0.2)], Some(1.0));
    assert_eq!(trace.steps[at(30.0)], Some(299.0));
    // Two frames a second.
    let heard = trace.received[at(30.0)].unwrap_or(0.0);
    assert!((40.0..=61.0).contains(&heard), "{heard}");
    assert!(trace.places[at(30.0)][1] > 100.0, "10 mm/s");
}

#[test]
fn a_failed_robot_does_nothing() {
    let trace =
        trace(&here("fail"), "[[event]]\nat = 10\nfail = 1\n[[event]]\nat = 20\nresume = 1\n");
    assert_eq!(trace.steps[at(10.0)], Some(99.0));
    assert_eq!(trace.steps[at(30.0)], Some(99.0));
    assert_eq!(trace.states[at(30.0)], Some(RobotState::Failed));
    let moved = trace.places[at(30.0)][1] - trace.places[at(10.1)][1];
    assert!(moved.abs() < 0.1, "{moved}");
}

#[test]
fn a_stopped_robot_can_be_resumed() {
    let trace = trace(
        &here("stop"),
        "[[event]]\nat = 10\nstop = \"all\"\n[[event]]\nat = 20\nresume = \"all\"\n",
    );
    assert_eq!(trace.steps[at(20.0)], Some(99.0));
    assert_eq!(trace.steps[at(20.1)], Some(100.0));
    assert_eq!(trace.steps[at(30.0)], Some(199.0));
    assert_eq!(trace.received[at(19.9)], trace.received[at(10.1)]);
    assert!(trace.received[at(30.0)] > trace.received[at(20.0)]);
}

#[test]
fn a_joining_robot_starts_its_script() {
    let test = here("join");
    let text = scenario("[[event]]\nat = 10\njoin = 1\n").replace(
        "positions = [[-30, 0], [30, 0]]",
        "positions = [[-30, 0]]\n[[robots]]\nrobot = \"kilobot\"\nscript = \"counter.bzz\"\npositions = [[30, 0]]\npresent = false",
    );
    let mut steps = Vec::new();
    let mut views = Vec::new();
    run_with(&test, &text, 1, |simulation| {
        steps.push(simulation.read(&simulation.setup().plots()[0], 1).number());
        views.push(simulation.view(1).is_some());
    });
    assert_eq!((views[at(10.0)], views[at(10.1)]), (false, true));
    assert_eq!(steps[at(10.0)], None);
    assert_eq!(steps[at(10.1)], Some(0.0));
    assert_eq!(steps[at(30.0)], Some(199.0));
}

#[test]
fn events_move_robots() {
    let events = "[[event]]\nat = 10\nmove = 1\nto = [200, -200]\nheading = 0\n\
                  [[event]]\nat = 20\nmove = [0, 1]\nby = [0, 50]\n";
    let trace = trace(&here("move"), events);
    let [x, y] = trace.places[at(10.1)];
    assert!((x - 201.0).abs() < 2.0 && (y + 200.0).abs() < 2.0, "{x} {y}");
    // It looks along x now. Unlike motors make it go in a curve.
    assert!(trace.places[at(20.0)][0] > 240.0, "{:?}", trace.places[at(20.0)]);
    let jump = trace.places[at(20.1)][1] - trace.places[at(20.0)][1];
    assert!((jump - 50.0).abs() < 2.0, "{jump}");
}

#[test]
fn blocked_links_carry_nothing_until_they_are_restored() {
    let events = "[[event]]\nat = 5\nblock = [0, 1]\n[[event]]\nat = 15\nrestore = [0, 1]\n";
    let trace = trace(&here("block"), events);
    assert!(trace.received[at(5.0)] > Some(0.0));
    assert_eq!(trace.received[at(5.2)], trace.received[at(15.0)]);
    assert!(trace.received[at(30.0)] > trace.received[at(15.0)]);
}

#[test]
fn a_partition_separates_robots_until_it_heals() {
    let events = "[[event]]\nat = 5\npartition = [0, 1]\n[[event]]\nat = 15\nheal = true\n";
    let trace = trace(&here("partition"), events);
    assert!(trace.received[at(5.0)] > Some(0.0));
    assert_eq!(trace.received[at(5.2)], trace.received[at(15.0)]);
    assert!(trace.received[at(30.0)] > trace.received[at(15.0)]);
}

#[test]
fn an_event_sets_the_loss_of_a_medium() {
    let trace = trace(&here("loss"), "[[event]]\nat = 5\nloss = 1\n[[event]]\nat = 15\nloss = 0\n");
    assert!(trace.received[at(5.0)] > Some(0.0));
    assert_eq!(trace.received[at(5.2)], trace.received[at(15.0)]);
    assert!(trace.received[at(30.0)] > trace.received[at(15.0)]);
}

#[test]
fn events_change_lamps() {
    let script = "seen = 0\nfunction step() { seen = light() }\n";
    let test = folder("light", &[("see.bzz", script)]);
    let text = "[world]\nsize = [1000, 1000]\nduration = 15\nambient = 20\nlights = [[100, 0]]\n\
         [[robots]]\nrobot = \"kilobot\"\nscript = \"see.bzz\"\npositions = [[0, 0]]\nheading = 0\n\
         [output]\nplot = [\"global.seen\"]\n\
         [[event]]\nat = 5\nlight = { at = [100, 0], brightness = 100 }\n[[event]]\nat = 10\nlight = []\n";
    let mut seen = Vec::new();
    run_with(&test, text, 1, |simulation| {
        seen.push(simulation.read(&simulation.setup().plots()[0], 0).number().unwrap_or(-1.0));
    });
    // ARGoS' law: intensity times e^(-2 d), with the lamp 0.1 m ahead.
    let law = |brightness: f64| 20.0 + brightness * (-0.2f64).exp();
    assert!((seen[at(5.0)] - law(1023.0)).abs() <= 1.0, "{}", seen[at(5.0)]);
    assert!((seen[at(10.0)] - law(100.0)).abs() <= 1.0, "{}", seen[at(10.0)]);
    assert_eq!(seen[at(15.0)], 20.0);
}

#[test]
fn events_happen_in_the_order_of_time_and_then_of_the_file() {
    let events = "[[event]]\nat = 2\nmove = 1\nby = [0, 10]\n[[event]]\nat = 1\nstop = 1\n\
                  [[event]]\nat = 2\nmove = 1\nto = [0, -300]\n";
    let trace = trace(&here("order"), events);
    assert_eq!(trace.places[at(2.1)], [0.0, -300.0]);
    let parsed = Scenario::parse(
        &scenario(events),
        "t",
        &here("order"),
        &[],
        &bittybuzz_robot_models::all(),
    );
    let parsed = parsed.unwrap_or_else(|errors| panic!("{errors:?}"));
    assert!(parsed.events.windows(2).all(|pair| pair[0].at <= pair[1].at));
}

/// Failed, stopped, faulted and running robots begin anew where they are, with new dice; their motors are off at first.
#[test]
fn restarted_robots_start_their_script_again() {
    let events = "[[event]]\nat = 5\nfail = 1\n[[event]]\nat = 10\nrestart = 1\n\
                  [[event]]\nat = 20\nstop = 1\n[[event]]\nat = 22\nrestart = \"all\"\n";
    let trace = trace(&here("restart"), events);
    assert_eq!((trace.steps[at(5.0)], trace.steps[at(9.9)]), (Some(49.0), Some(49.0)));
    assert_eq!(trace.states[at(9.9)], Some(RobotState::Failed));
    // Global code and init in the first tick, then a step in each.
    assert_eq!((trace.steps[at(10.1)], trace.steps[at(11.1)]), (Some(0.0), Some(10.0)));
    assert_eq!(trace.states[at(10.1)], Some(RobotState::Running));
    assert_eq!((trace.steps[at(22.1)], trace.steps[at(30.0)]), (Some(0.0), Some(79.0)));
    let [from, to] = [at(9.9), at(10.1)].map(|at| trace.places[at]);
    assert_eq!(from, to, "it is where it was");
    // It hears the other one again.
    assert!(trace.received[at(20.0)] > Some(10.0), "{:?}", trace.received[at(20.0)]);
}

#[test]
fn a_restart_changes_random_numbers_and_keeps_fault_counts() {
    let script = "dice = -1\nfunction init() { dice = math.rng.uniform(0, 30000) log(dice) }\n\
                  function step() { if(id == 1) dice.x = 1 }\n";
    let folder = folder("restart_fault", &[("dice.bzz", script)]);
    let text = "[world]\nsize = [1000, 1000]\nduration = 3\n\
                [[robots]]\nrobot = \"kilobot\"\nscript = \"dice.bzz\"\npositions = [[-30, 0], [30, 0]]\n\
                [[robots]]\nname = \"away\"\nrobot = \"kilobot\"\nscript = \"dice.bzz\"\npresent = false\n\
                [[event]]\nat = 2\nrestart = \"all\"\n[output]\nplot = [\"global.dice\"]\n";
    let mut dice = Vec::new();
    let mut lines = 0;
    let summary = run_with(&folder, text, 1, |simulation| {
        let probe = &simulation.setup().plots()[0];
        dice.extend(simulation.read(probe, 0).number());
        assert!(simulation.view(2).is_none(), "who has not joined is not restarted");
        // Nobody looks for a while: what was logged before the restart is still there.
        if simulation.now() > 25 {
            lines += simulation.take_log().len();
        }
    });
    dice.dedup();
    assert_eq!(dice.len(), 2, "{dice:?}");
    // Robot 1 has started again by itself at 1.1 s.
    assert_eq!(lines, 5);
    let times: Vec<(usize, u64)> =
        summary.faults.iter().map(|fault| (fault.robot, fault.record.tick)).collect();
    assert_eq!(times, [(1, 1), (1, 21)]);
}
