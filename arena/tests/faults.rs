//! A fault ends what caused it: a listener's call, or the run of the script, which starts again after a pause.

use crate::script::{folder, read, run, run_with};
use bittybuzz_arena::output::metrics;
use bittybuzz_arena::robot::{Consequence, FaultCounts};
use bittybuzz_arena::run::{Simulation, Summary};
use bittybuzz_vm_core::FaultCode;

/// A world of robots that run `s.bzz`, 90 mm apart: each hears its two neighbors only.
fn row(robot: &str, count: usize, seconds: u32, more: &str) -> String {
    let places: Vec<String> = (0..count).map(|place| format!("[{}, 0]", 90 * place)).collect();
    let places = places.join(", ");
    let (medium, clock) = if robot == "kilobot" {
        ("[medium.ir]\nloss = 0\nrange = 70\nedge = 0\n", "clock_skew = 0\n")
    } else {
        ("", "")
    };
    format!(
        "[world]\nsize = [2000, 1000]\nduration = {seconds}\n{medium}[[robots]]\n\
         robot = \"{robot}\"\nscript = \"s.bzz\"\nheading = 0\n{clock}positions = [{places}]\n{more}"
    )
}

fn is_faulted(simulation: &mut Simulation, robot: usize) -> bool {
    simulation.is_faulted(robot)
}

/// The third step after each start fails.
const EVERY_THIRD: &str = "n = 0\nfunction step() { n = n + 1 forward() if(n == 3) n.x = 1 }\n";

#[test]
fn a_script_starts_again_after_pauses_that_double() {
    let folder = folder("doubling", &[("s.bzz", EVERY_THIRD)]);
    let mut is_halted = Vec::new();
    let summary = run_with(&folder, &row("kilobot", 1, 10, ""), 1, |simulation| {
        is_halted.push(is_faulted(simulation, 0));
    });
    // Tick 0 is that of global code and init(); the step of tick 3 fails. Ten ticks later the script starts again.
    let ends = [3, 13, 16, 36, 39, 79, 82];
    let expected: Vec<bool> =
        (0..100).map(|tick| ends.iter().filter(|end| **end <= tick).count() % 2 == 1).collect();
    assert_eq!(is_halted, expected);
    let [fault] = summary.faults.as_slice() else { panic!("{:?}", summary.faults) };
    assert_eq!((fault.record.tick, fault.record.count), (3, 4));
    assert_eq!(fault.record.consequence, Consequence::Pause(10));
    assert_eq!(summary.fault_counts, FaultCounts { faults: 4, restarts: 3, handler_faults: 0 });
}

#[test]
fn motors_stop_in_the_pause_after_a_fault() {
    let script = "n = 0\nfunction step() { n = n + 1 forward() if(n == 30) n.x = 1 }\n";
    for robot in ["kilobot", "zooids"] {
        let folder = folder(&format!("still_{robot}"), &[("s.bzz", script)]);
        let mut places = Vec::new();
        run_with(&folder, &row(robot, 1, 5, ""), 1, |simulation| {
            places.extend(simulation.view(0).map(|view| view.pose.x));
        });
        // The fault is in tick 30, the next start in tick 40.
        assert_ne!(places[28], places[29], "{robot} moves: {places:?}");
        assert_eq!(places[31], places[39], "{robot} stands");
        assert_ne!(places[42], places[49], "{robot} moves again: {places:?}");
    }
}

#[test]
fn a_robot_relays_messages_in_the_pause_after_a_fault() {
    let script = "s = stigmergy.create(1)\nt = 0\nheard = 0\nfunction step() {\n t = t + 1\n \
                  if(id == 0 and t == 20) s.put(\"x\", 7)\n if(id == 1) t.x = 1\n if(s.get(\"x\") == 7) heard = 1\n}\n";
    let folder = folder("relay", &[("s.bzz", script)]);
    let mut first = None;
    // Its third pause is from 3.4 to 7.4 s.
    let text = row("kilobot", 3, 7, "[output]\nplot = [\"global.heard\"]\n");
    run_with(&folder, &text, 1, |simulation| {
        let heard = simulation.read(&simulation.setup().plots()[0], 2).number();
        if heard == Some(1.0) && first.is_none() {
            first = Some((simulation.now(), simulation.is_faulted(1)));
        }
    });
    let (_, middle_is_halted) = first.unwrap();
    assert!(middle_is_halted, "the middle robot is in its pause when the last one has the entry");
}

#[test]
fn an_assertion_that_fails_stops_the_script_for_good() {
    let script = "t = 0\nfunction init() { neighbors.listen(\"x\", function(t, v, i) { assert(v == 1) }) }\n\
                  function step() {\n t = t + 1\n assert(id != 0 or t < 5)\n if(t == 10) neighbors.broadcast(\"x\", id)\n}\n";
    let folder = folder("assertion", &[("s.bzz", script)]);
    let text = row("kilobot", 3, 60, "");
    let mut halted = Vec::new();
    let summary = run_with(&folder, &text, 1, |simulation| {
        halted = (0..3).map(|robot| simulation.is_faulted(robot)).collect();
    });
    // Robot 1 asserts in a listener, after robot 2 has sent.
    assert_eq!(halted, [true, true, false]);
    let consequences: Vec<_> = summary
        .faults
        .iter()
        .map(|fault| (fault.robot, fault.record.fault.code, fault.record.consequence))
        .collect();
    let expected = [0, 1].map(|robot| (robot, FaultCode::AssertFailed, Consequence::Stop));
    assert_eq!(consequences, expected);
}

/// Robot 0 sends 0 to 9 in turn; each of them fails at a place of its own.
const TEN_PLACES: &str = "t = 0\nfunction init() { neighbors.listen(\"x\", function(t, v, i) {\n\
    if(v == 0) v.x = 1 if(v == 1) v.x = 1 if(v == 2) v.x = 1 if(v == 3) v.x = 1 if(v == 4) v.x = 1\n\
    if(v == 5) v.x = 1 if(v == 6) v.x = 1 if(v == 7) v.x = 1 if(v == 8) v.x = 1 if(v == 9) v.x = 1\n}) }\n\
    function step() { t = t + 1 if(id == 0 and t % 5 == 0) neighbors.broadcast(\"x\", (t / 5) % 10) }\n";

#[test]
fn a_fault_in_a_listener_ends_that_call() {
    let folder = folder("contained", &[("s.bzz", TEN_PLACES)]);
    let text = row("kilobot", 2, 60, "[output]\nplot = [\"steps\", \"handler_faults\"]\n");
    let summary = run(&folder, &text);
    assert_eq!(summary.values[0], Some([599.0; 3]), "no step is missed");
    let [_, least, most] = summary.values[1].unwrap();
    assert!(least == 0.0 && most > 100.0, "{most}");
    let FaultCounts { faults, restarts, handler_faults } = summary.fault_counts;
    assert_eq!((faults, restarts, handler_faults as f64), (0, 0, most));
    // Eight places are remembered, with their counts.
    assert_eq!(summary.faults.len(), 8);
    for fault in &summary.faults {
        assert_eq!((fault.robot, fault.record.consequence), (1, Consequence::Contained));
        assert!(fault.record.count >= 10, "{fault:?}");
        assert!(fault.record.positions.len() == 1, "{fault:?}");
    }
    let counted: u32 = summary.faults.iter().map(|fault| fault.record.count).sum();
    assert!(u64::from(counted) < handler_faults, "two more places are counted");
}

#[test]
fn on_fault_stops_a_group_for_good() {
    let script = "t = 0\nfunction init() { neighbors.listen(\"x\", function(t, v, i) { v.x = 1 }) }\n\
                  function step() { t = t + 1 if(t == 5) neighbors.broadcast(\"x\", 1) if(id == 0 and t == 20) t.x = 1 }\n";
    let folder = folder("on_fault", &[("s.bzz", script)]);
    let summary = run(&folder, &row("kilobot", 2, 20, "on_fault = \"stop\"\n"));
    assert_eq!(summary.fault_counts, FaultCounts { faults: 2, ..FaultCounts::default() });
    assert!(summary.faults.iter().all(|fault| fault.record.consequence == Consequence::Stop));
    let summary = run(&folder, &row("kilobot", 2, 20, "on_fault = \"restart\"\n"));
    assert!(summary.fault_counts.restarts > 0 && summary.fault_counts.handler_faults >= 2);
}

#[test]
fn a_robot_file_sets_the_consequence_of_a_fault() {
    let file = include_str!("../../robots/kilobot/robot.toml");
    let file = file.replacen("[vm]", "on_fault = \"stop\"\n[vm]", 1);
    let folder = folder("on_fault_file", &[("s.bzz", EVERY_THIRD), ("mine.toml", &file)]);
    let text = row("mine.toml", 1, 10, "body = \"kilobot\"\n");
    assert_eq!(run(&folder, &text).fault_counts.restarts, 0);
    // The scenario has the last word.
    let text = row("mine.toml", 1, 10, "body = \"kilobot\"\non_fault = \"restart\"\n");
    assert_eq!(run(&folder, &text).fault_counts.restarts, 3);
}

/// A run with an error fails, unless an expectation counts the errors of the robot that had it.
#[test]
fn expected_errors_do_not_fail_a_run() {
    let expect = |value: &str, robots: &str| {
        format!(
            "[[expect]]\nat = 10\nvalue = \"{value}\"\nrobots = {robots}\nof = \"sum\"\nabove = 0\n"
        )
    };
    let success = |name: &str, script: &str, more: &str| {
        let folder = folder(&format!("expected_{name}"), &[("s.bzz", script)]);
        let summary = run(&folder, &row("kilobot", 2, 10, more));
        assert!(
            summary
                .convergences
                .iter()
                .all(|expectation| { expectation.verdict == bittybuzz_arena::run::Verdict::Held })
        );
        summary.is_success()
    };
    let restarting = "n = 0\nfunction step() { n = n + 1 if(id == 0 and n == 30) n.x = 1 }\n";
    assert!(!success("1", restarting, ""));
    assert!(success("1", restarting, &expect("faults", "\"all\"")));
    assert!(success("1", restarting, &expect("restarts", "0")));
    let other = "[[expect]]\nat = 10\nvalue = \"faults\"\nrobots = 1\nequals = 0\n";
    assert!(!success("1", restarting, other), "robot 0 is not meant");
    // Who counts restarts does not expect a script that never starts again.
    let once = "n = 0\nfunction step() { n = n + 1 if(id == 0 and n == 30) n.x = 1 assert(id == 0 or n < 90) }\n";
    assert!(!success("2", once, &expect("restarts", "\"all\"")));
    assert!(success("2", once, &expect("faults", "\"all\"")));
    // The number of handlers that failed is another one.
    let handler = "n = 0\nfunction init() { neighbors.listen(\"x\", function(t, v, i) { v.x = 1 }) }\n\
                   function step() { n = n + 1 if(id == 0 and n == 9) neighbors.broadcast(\"x\", 1) }\n";
    assert!(!success("3", handler, ""));
    assert!(!success("3", handler, "[[expect]]\nat = 10\nvalue = \"faults\"\nequals = 0\n"));
    assert!(success("3", handler, &expect("handler_faults", "\"all\"")));
}

#[test]
fn a_table_of_runs_has_the_numbers_of_faults() {
    let folder = folder("columns", &[("s.bzz", EVERY_THIRD)]);
    let text = row("kilobot", 2, 10, "");
    let (scenario, _) = read(&folder, &text);
    let summary: Summary = run(&folder, &text);
    let columns = metrics::metrics(&scenario);
    let values = metrics::values(&scenario, &summary);
    assert_eq!(columns.len(), values.len());
    let value = |name: &str| {
        let column = columns.iter().position(|column| column.name == name);
        column.and_then(|column| values[column])
    };
    assert_eq!(value("faults"), Some(8.0));
    assert_eq!(value("restarts"), Some(6.0));
    assert_eq!(value("handler_faults"), Some(0.0));
    assert_eq!(value("success"), Some(0.0));
}

/// It comes down as with `land()`, and stays on the ground until it is switched off and on.
#[test]
fn a_crazyflie_lands_at_a_fault_and_does_not_take_off_again() {
    let script = "n = 0\nfunction init() { takeoff(1000) forward() }\n\
                  function step() { n = n + 1 hover(1000) goto(300, 0) if(n == 10) n.x = 1 }\n";
    let folder = folder("lands", &[("s.bzz", script)]);
    let (mut heights, mut halted) = (Vec::new(), Vec::new());
    let text = row(
        "crazyflie",
        1,
        30,
        "[[event]]\nat = 25\nrestart = 0\n[body.crazyflie]\narmed = true\n",
    );
    run_with(&folder, &text, 1, |simulation| {
        heights.extend(simulation.view(0).map(|view| view.pose.z));
        halted.push(is_faulted(simulation, 0));
    });
    let fault = halted.iter().position(|halted| *halted).unwrap();
    assert!(heights[fault] > 300.0, "it flies, {heights:?}");
    for (before, after) in heights[fault..250].iter().zip(&heights[fault + 1..250]) {
        // 500 mm/s, and some more where it swings into them.
        assert!(before - after <= 60.0, "it falls, {heights:?}");
    }
    let landed = fault + 60;
    assert!(heights[landed..250].iter().all(|z| *z == 0.0), "{heights:?}");
    assert!(halted[landed..250].contains(&false), "the script runs again meanwhile");
    assert!(heights[250..].iter().any(|z| *z > 300.0), "after power-on it flies");
}
