//! Whoever watches a Kilobot learns from its light why its script has stopped, and where in the file.

use bittybuzz_hil::{Core, ScriptFile, kilobot};
use bittybuzz_tests::bbz::{self, Outcome};
use serde_json::Value;

/// It stops in line 6, a second after its start.
const SCRIPT: &str = "\
n = 0
function init() { led(2) forward() }
function step() {
  n = n + 1
  led(1)
  if(n == 10) { x = n / (n - 10) }
}
";

fn trace(script: &ScriptFile, options: &[&str]) -> Outcome {
    let [image, emulator] =
        [kilobot(), Core::Avr.program().into()].map(|path| path.display().to_string());
    let robot = ["trace", &image, "--robot", "kilobot", "--script", script.path(), "--emulate"];
    bbz::run(&[&robot[..], &["--emulator", &emulator, "--seconds", "2.5"], options].concat(), &[])
}

#[test]
fn a_trace_prints_outputs_the_fault_and_the_restart_once() {
    let script = ScriptFile::new("kilobot_trace", SCRIPT);
    let outcome = trace(&script, &["--outputs"]);
    assert_eq!(outcome.status, Some(1), "{}", outcome.stderr);
    for state in ["led red 0, green 3, blue 0 of 3", "led red 3, green 0, blue 0 of 3", "motor 1"] {
        assert!(outcome.stdout.contains(state), "{}", outcome.stdout);
    }
    assert_eq!(outcome.stderr.matches("error[R0005]").count(), 1, "{}", outcome.stderr);
    assert!(outcome.stderr.contains(&format!("{}:6:", script.path())), "{}", outcome.stderr);
    // After a pause of a second.
    let restarts = outcome.stdout.matches("the script starts again").count();
    assert_eq!(restarts, 1, "{}", outcome.stdout);
}

#[test]
fn a_trace_for_programs_ends_with_the_fault() {
    let script = ScriptFile::new("kilobot_json", SCRIPT);
    let outcome = trace(&script, &["--json", "--until-fault"]);
    assert_eq!(outcome.status, Some(1), "{}", outcome.stderr);
    let lines: Vec<Value> =
        outcome.stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let [fault] = &lines[..] else { panic!("{lines:?}") };
    assert_eq!((&fault["kind"], &fault["step"]), (&"fault".into(), &Value::Null));
    assert_eq!((&fault["code"], &fault["calls"][0]["line"]), (&"R0005".into(), &6.into()));
    // Started by the controller, ten steps later.
    let time = fault["time"].as_f64().unwrap();
    assert!((0.9..1.2).contains(&time), "{time}");
}

/// Two stop, the third does not.
#[test]
fn a_scenario_counts_the_scripts_that_have_stopped() {
    let script = ScriptFile::new(
        "kilobot_scenario",
        "function step() { if(id < 2) { x = nowhere.x } else { led(2) } }\n",
    );
    let scenario = format!(
        "[world]\nsize = [400, 400]\nduration = 2\n[[robots]]\nrobot = \"kilobot\"\nscript = '{}'\ncount = 3\n\
         placement = \"grid\"\nspacing = 80\nbackend = \"firmware\"\nfirmware = '{}'\n",
        script.path(),
        kilobot().display()
    );
    let scenario = ScriptFile::scenario("kilobot_faults", &scenario);
    let emulator = Core::Avr.program().display().to_string();
    let outcome = bbz::run(&["sim", scenario.path(), "--emulator", &emulator], &[]);
    assert!(outcome.stdout.contains("scripts stopped by an error: 2, "), "{}", outcome.stdout);
    assert!(outcome.stderr.contains("error[R0002]"), "{}", outcome.stderr);
    assert!(outcome.stderr.contains(&format!("{}:1:", script.path())), "{}", outcome.stderr);
}
