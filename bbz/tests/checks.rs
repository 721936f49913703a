//! `--checks`: the report about a script; everything else stays unchanged.

use std::fs;
use std::path::Path;

use crate::support::Folder;
use serde_json::Value;

/// The square wraps from step 3 of robot 1 on: 181 squared is 32761, 182 squared 33124.
const SCRIPT: &str =
    "d = 179\n\nfunction step() {\n  d = d + 1\n  var area = d * d\n  log(area)\n}\n";

const SCENARIO: &str = "[world]\nsize = [500, 500]\nduration = 1\n\
    [[robots]]\nname = \"pair\"\nrobot = \"kilobot\"\nscript = \"s.bzz\"\ncount = 2\nfirst_id = 7\n";

#[test]
fn wrapped_numbers_are_reported_after_the_output() {
    let folder = Folder::with("checks_run", "s.bzz", SCRIPT);
    let arguments = ["run", "s.bzz", "--robot", "kilobot", "--steps", "5"];
    let plain = folder.bbz(&arguments);
    let checked = folder.bbz(&[&arguments[..], &["--checks"]].concat());
    assert_eq!((plain.status, checked.status), (Some(0), Some(0)));
    // 180^2, 181^2, then 65536 less than 182^2, 183^2 and 184^2.
    assert_eq!(plain.stdout, "32400\n32761\n-32412\n-32047\n-31680\n");
    assert_eq!((checked.stdout.as_str(), plain.stderr.as_str()), (plain.stdout.as_str(), ""));
    let lines: Vec<&str> = checked.stderr.lines().collect();
    let wrapped = "s.bzz:5:14: wrapped 3 times, first 182 * 182 = 33124 became -32412 at 0.3 s";
    assert_eq!(lines[0], wrapped, "{}", checked.stderr);
    // The Kilobot has 339 slots and 8 MHz, and ten steps per second.
    assert!(lines[1].starts_with("memory     ") && lines[1].contains(" of 339 slots at "));
    assert!(lines[2].starts_with("calls      1 function deep at 0.0 s"), "{}", lines[2]);
    assert!(lines[3].starts_with("step       about "), "{}", lines[3]);
    assert!(lines[3].ends_with(" % of the time until the next"), "{}", lines[3]);
    assert_eq!(lines.len(), 4, "{}", checked.stderr);
}

#[test]
fn a_run_without_anomalies_reports_that() {
    let folder = Folder::with("checks_none", "s.bzz", SCRIPT);
    let outcome = folder.bbz(&["run", "s.bzz", "--steps", "5", "--checks"]);
    outcome.reports(&[
        "no number wrapped, saturated, was flushed to zero, or became infinite or NaN; each sum had an effect\n",
        " of 65520 slots at ",
        "step       the cycles of instructions were not counted on this chip\n",
    ]);
    assert_eq!(outcome.status, Some(0));
}

/// The bits of a float do not reach from 128 to 0.1 in `tiny`, nor from 2^24 to 1 in `full`.
#[test]
fn sums_without_an_effect_are_reported() {
    let clock = "time = 0.0\nfunction step() {\n  time = time + 0.1\n}\n";
    let folder = Folder::with("checks_clock", "s.bzz", clock);
    let run = |profile, steps| {
        let outcome =
            folder.bbz(&["run", "s.bzz", "--profile", profile, "--steps", steps, "--checks"]);
        outcome.stderr
    };
    let found = run("tiny", "2000");
    let line = found.lines().find(|line| line.contains("had no effect")).unwrap();
    assert!(line.starts_with("s.bzz:3:10: had no effect "), "{found}");
    // The nearest float to 0.1.
    assert!(line.contains(" times, first 128.0 + 0.0999"), "{found}");
    assert!(found.contains("`time` stops at 128: adding 0.1 to it"), "{found}");
    assert!(!run("full", "2000").contains("had no effect"));
    assert!(!run("tiny", "100").contains("had no effect"));

    folder.write(
        "s.bzz",
        "b = 16777216.0\nlog(b + 1.0, b - 0.25, 0.25 - b, 0.0 + b, b - b, b * 1.0, 16777216 + 2)\n",
    );
    let found = run("full", "0");
    let lines: Vec<&str> =
        found.lines().filter(|line| line.contains("had no effect once")).collect();
    assert_eq!(lines.len(), 3, "{found}");
    for operation in ["16777216.0 + 1.0", "16777216.0 - 0.25", "0.25 - 16777216.0"] {
        assert!(lines.iter().any(|line| line.contains(operation)), "{operation}: {found}");
    }
}

/// The most frequent places come first, and only 20 are printed.
#[test]
fn places_are_sorted_and_limited() {
    let mut script = "b = 30000\nfunction step() {\n".to_owned();
    for line in 0..25 {
        script += &format!("  if(n % {} == 0) log(b + b)\n", line + 1);
    }
    script += "  n = n + 1\n}\nn = 0\n";
    let folder = Folder::with("checks_many", "s.bzz", &script);
    let arguments = ["run", "s.bzz", "--profile", "tiny", "--steps", "60", "--checks"];
    let outcome = folder.bbz(&arguments);
    let lines: Vec<&str> = outcome.stderr.lines().collect();
    // Line k + 3 counts those of 60 steps whose number, from 0, is a multiple of k + 1.
    assert!(lines[0].starts_with("s.bzz:3:22: wrapped 60 times, first 30000 + 30000 = 60000"));
    assert!(lines[1].starts_with("s.bzz:4:22: wrapped 30 times,"), "{}", lines[1]);
    assert!(lines[2].starts_with("s.bzz:5:22: wrapped 20 times,"), "{}", lines[2]);
    // The numbers 21 to 25 have three multiples each: 0, 21, 42 and so on.
    assert_eq!(lines[20], "5 other places: 15 times", "{}", outcome.stderr);
}

#[test]
fn a_fault_is_reported_before_the_checks_and_its_status_stays() {
    let script = "n = 32767\nfunction step() {\n  n = n + 1\n  log(1 / nothing)\n}\n";
    let folder = Folder::with("checks_fault", "s.bzz", script);
    let outcome = folder.bbz(&["run", "s.bzz", "--profile", "tiny", "--steps", "3", "--checks"]);
    assert_eq!(outcome.status, Some(1));
    let fault = outcome.stderr.find("error[R").unwrap();
    let check = outcome.stderr.find("s.bzz:3:7: wrapped once, first 32767 + 1 = 32768").unwrap();
    assert!(fault < check, "{}", outcome.stderr);
}

#[test]
fn an_image_without_symbols_has_positions() {
    let folder = Folder::with("checks_image", "s.bzz", SCRIPT);
    assert_eq!(folder.bbz(&["build", "s.bzz", "--robot", "kilobot"]).status, Some(0));
    fs::remove_file(folder.path("s.sym")).unwrap();
    let outcome = folder.bbz(&["run", "s.bbi", "--steps", "5", "--checks"]);
    outcome.reports(&["position ", " of the code: wrapped 3 times, first 182 * 182"]);
}

#[test]
fn a_simulation_reports_each_group_after_its_summary() {
    let folder = Folder::with("checks_sim", "s.bzz", SCRIPT);
    folder.write("s.toml", SCENARIO);
    let plain = folder.bbz(&["sim", "s.toml"]);
    let checked = folder.bbz(&["sim", "s.toml", "--checks"]);
    assert_eq!((plain.status, checked.status), (Some(0), Some(0)));
    // The rate depends on the computer.
    let lines = |text: &str| -> Vec<String> {
        let lines = text.lines().filter(|line| !line.contains("robot-seconds per second"));
        lines.map(str::to_owned).collect()
    };
    let (before, after) = checked.stdout.split_once("checks of group `pair`:\n").unwrap();
    assert_eq!(lines(before), lines(&plain.stdout));
    let after: Vec<&str> = after.lines().collect();
    // Two robots, steps 3 to 9.
    let wrapped =
        "  s.bzz:5:14: wrapped 14 times, first 182 * 182 = 33124 became -32412 at 0.3 s, robot 7";
    assert_eq!(after[0], wrapped);
    assert!(after[1].contains(" of 339 slots at ") && after[1].ends_with(" s, robot 7"));
}

#[test]
fn a_script_that_an_event_loads_has_a_report_of_its_own() {
    let folder = Folder::with("checks_load", "s.bzz", SCRIPT);
    folder.write("other.bzz", "big = 32767\nfunction step() {\n  log(big + 1)\n}\n");
    let load = "[[event]]\nat = 0.5\nload = 8\nscript = \"other.bzz\"\n";
    folder.write("s.toml", [SCENARIO, load].concat());
    let outcome = folder.bbz(&["sim", "s.toml", "--checks"]);
    let (_, reports) = outcome.stdout.split_once("checks of group `pair`:\n").unwrap();
    let (own, loaded) = reports.split_once("checks of group `pair` with `other.bzz`:\n").unwrap();
    // Steps 3 to 9 of robot 7, and steps 3 and 4 of robot 8; its steps 6 to 9 are those of the other script.
    assert!(own.contains("  s.bzz:5:14: wrapped 9 times"), "{own}");
    assert!(loaded.contains("  other.bzz:3:7: wrapped 4 times, first 32767 + 1"), "{loaded}");
    let json = folder.bbz(&["sim", "s.toml", "--checks", "--json"]);
    let json: Value = serde_json::from_str(&json.stdout).unwrap();
    assert_eq!(json["checks"][0]["loaded"], Value::Null);
    assert_eq!(json["checks"][1]["loaded"], "other.bzz");
}

#[test]
fn json_has_the_findings_of_each_group() {
    let folder = Folder::with("checks_json", "s.bzz", SCRIPT);
    folder.write("s.toml", SCENARIO);
    let object = |arguments: &[&str]| -> Value {
        let outcome = folder.bbz(&[&["sim", "s.toml", "--json"], arguments].concat());
        assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
        serde_json::from_str(&outcome.stdout).unwrap()
    };
    let plain = object(&[]);
    let mut checked = object(&["--checks"]);
    let checks = checked.as_object_mut().unwrap().remove("checks").unwrap();
    assert_eq!(checked, plain);
    let group = &checks[0];
    assert_eq!((&group["group"], &group["robot"]), (&"pair".into(), &"kilobot".into()));
    assert_eq!(group["emulated"], false);
    let found = &group["checks"];
    let place = serde_json::json!({
        "kind": "wrapped", "count": 14, "position": found["places"][0]["position"],
        "file": "s.bzz", "line": 5, "column": 14,
        "first": { "operation": "182 * 182", "exact": 33124, "result": -32412, "time": 0.3, "robot": 7 },
    });
    assert_eq!(found["places"], serde_json::json!([place]));
    assert_eq!(found["slots"]["of"], 339);
    assert_eq!(found["calls"]["most"], 1);
    assert_eq!(found["entries"]["most"], 0);
    // Two robots with nine steps each, and 8 MHz.
    assert_eq!((&found["cycles"]["count"], &found["cycles"]["of"]), (&18.into(), &800_000.into()));
}

#[test]
fn a_run_has_its_findings_in_the_last_object() {
    let folder = Folder::with("checks_run_json", "s.bzz", SCRIPT);
    let arguments = ["run", "s.bzz", "--robot", "kilobot", "--steps", "5", "--json"];
    let plain = folder.bbz(&arguments);
    let checked = folder.bbz(&[&arguments[..], &["--checks"]].concat());
    assert_eq!((checked.status, checked.stderr.as_str()), (Some(0), ""));
    let objects = |text: &str| -> Vec<Value> {
        text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
    };
    let (mut found, expected) = (objects(&checked.stdout), objects(&plain.stdout));
    let last = found.last_mut().unwrap().as_object_mut().unwrap();
    let checks = last.remove("checks").unwrap();
    assert_eq!(found, expected);
    assert_eq!(checks["places"][0]["count"], 3);
    assert_eq!(checks["places"][0]["first"]["exact"], 33124);
    assert_eq!(checks["slots"]["of"], 339);
}

#[test]
fn many_runs_are_not_checked() {
    let folder = Folder::with("checks_runs", "s.bzz", SCRIPT);
    folder.write("s.toml", SCENARIO);
    folder
        .bbz(&["sim", "s.toml", "--checks", "--runs", "3"])
        .fails_with(3, &["--checks", "--runs"]);
    let several = ["sim", "s.toml", "--checks", "--set", "world.duration=1,2"];
    folder.bbz(&several).fails_with(3, &["`--checks` reports one run"]);
}

/// The cycles that emulators count for a whole step of these scripts: `bench/baseline.json`. The table of costs has each
/// instruction by itself, so that it may be off by some percent.
#[test]
fn cycles_are_near_those_of_the_benchmarks() {
    let bench = Path::new(env!("CARGO_MANIFEST_DIR")).join("../bench");
    let text = fs::read_to_string(bench.join("baseline.json")).unwrap();
    let baseline: Value = serde_json::from_str(&text).unwrap();
    let folder = Folder::new("checks_cycles");
    for name in ["branchy", "closure", "fib10", "gloop", "loopsum", "method", "table16"] {
        let script = fs::read_to_string(bench.join(format!("scripts/{name}.bzz"))).unwrap();
        folder.write("s.bzz", script);
        for (robot, profile, target) in [
            ("kilobot", "tiny", "avr"),
            ("zooids", "tiny", "thumbv6m"),
            ("crazyflie", "full", "thumbv7em-full"),
        ] {
            let arguments = [
                "run",
                "s.bzz",
                "--robot",
                robot,
                "--profile",
                profile,
                "--steps",
                "3",
                "--checks",
            ];
            let outcome = folder.bbz(&arguments);
            let line = outcome.stderr.lines().find(|line| line.starts_with("step ")).unwrap();
            let (_, rest) = line.split_once("about ").unwrap();
            let found: f64 = rest.split_once(' ').unwrap().0.parse().unwrap();
            let counted = baseline[target][name]["count"].as_f64().unwrap();
            let ratio = found / counted;
            assert!((0.85..1.15).contains(&ratio), "{name} on {target}: {found} for {counted}");
        }
    }
}

/// Recording, summary and status of scenarios with messages, stigmergies, failures and chance.
#[test]
fn scenarios_leave_the_same_recording() {
    let scenarios = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/scenarios");
    let folder = Folder::new("checks_recordings");
    for name in ["outages", "convergence", "worm"] {
        let path = scenarios.join(format!("{name}.toml"));
        let run = |recording: &str, more: &[&str]| {
            let scenario = path.to_str().unwrap();
            let arguments = ["sim", scenario, "--json", "--record", recording];
            let outcome = folder.bbz(&[&arguments[..], more].concat());
            let object: Value = serde_json::from_str(&outcome.stdout)
                .unwrap_or_else(|error| panic!("{name}: {error}: {}", outcome.stderr));
            (outcome.status, outcome.stderr, object)
        };
        let plain = run("plain.bbr", &[]);
        let mut checked = run("checked.bbr", &["--checks"]);
        let checks = checked.2.as_object_mut().unwrap().remove("checks").unwrap();
        assert!(checks[0]["checks"]["slots"]["most"].as_u64().unwrap() > 0, "{name}: {checks}");
        assert_eq!(checked, plain, "{name}");
        assert!(folder.read("plain.bbr") == folder.read("checked.bbr"), "{name}");
    }
}
