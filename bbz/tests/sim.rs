//! `bbz sim`: its output, its files and its exit status.

use crate::support;
use crate::support::Folder;
use serde_json::Value;

const SCRIPT: &str =
    "n = 0\nfunction step() { n = n + 1 led(n % 8) if(n == 5 and id == 1) log(\"five \", n) }\n";

pub const SCENARIO: &str = "[world]\nsize = [500, 500]\nduration = 2\n\
    [[robots]]\nrobot = \"kilobot\"\nscript = \"s.bzz\"\ncount = 3\n\
    [output]\nplot = [\"global.n\"]\n\
    [[expect]]\nat = 2\nvalue = \"global.n\"\nequals = 19\n";

pub fn folder(test: &str) -> Folder {
    let folder = Folder::with(test, "s.bzz", SCRIPT);
    folder.write("s.toml", SCENARIO);
    folder
}

/// The scenario with exact clocks, for which the expectation holds with every seed.
pub fn exact() -> String {
    SCENARIO.replace("count = 3", "count = 3\nclock_skew = 0")
}

#[test]
fn a_scenario_that_holds_succeeds() {
    let outcome = folder("sim_holds").bbz(&["sim", "s.toml"]);
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
    let lines: Vec<&str> = outcome.stdout.lines().collect();
    assert_eq!(lines[0], "     0.5     1  five 5");
    assert!(lines[1].starts_with("3 robots, 2.0 s, seed 1: "), "{}", lines[1]);
    assert_eq!(
        lines[2],
        "held    s.toml:10: all: global.n equals 19, at 2 s; true for good since 2.0 s"
    );
    assert!(lines[3].starts_with("frames "), "{}", lines[3]);
}

#[test]
fn comments_that_the_page_cannot_use_are_warnings() {
    for (comment, message, help) in [
        ("# try: Robot 1 fails: fail 1", "no command to try", "`# try: Robot 15 fails: fail = 15`"),
        ("# try: Robot 7 fails: fail = 7", "no command to try", "help"),
        ("# try.fr: En panne : fails = 1", "no command to try", "help"),
        ("# try.french: En panne : fail = 1", "no command to try", "`# try.fr: …`"),
        ("# led: 1 = on", "no led of the page", "in the script"),
        ("# text.fr: Un essai.", "does not show this text", "`# text.fr: Une horloge.`"),
    ] {
        let folder = folder("sim_page_comments");
        folder.write("s.toml", format!("{SCENARIO}{comment}\n"));
        let outcome = folder.bbz(&["sim", "s.toml", "--headless"]);
        assert_eq!(outcome.status, Some(0), "{comment}");
        for part in ["warning", "s.toml:14:1", message, help] {
            assert!(outcome.stderr.contains(part), "{comment}: {}", outcome.stderr);
        }
    }
    let folder = folder("sim_good_page_comments");
    let head = "# A test.\n#\n# text.fr: Un essai.\n#\n# try: It fails: fail = 1\n\
        # try.fr: En panne : fail = 1\n";
    folder.write("s.toml", [head, SCENARIO].concat());
    let outcome = folder.bbz(&["sim", "s.toml", "--headless"]);
    assert_eq!((outcome.status, &*outcome.stderr), (Some(0), ""));
}

/// Three Kilobots send at most two frames of 4.41 ms per second each: 2.6 % of a second. With one table in 100 steps, which
/// are 10 s, a robot sends 0.4 frames per second: 0.53 % in all.
#[test]
fn long_messages_are_listed_with_their_share_of_the_air() {
    let folder = folder("sim_messages");
    folder.write(
        "s.bzz",
        "n = 0\nfunction step() { n = n + 1\n neighbors.broadcast(\"p\", {.x = 1, .y = 2})\n \
         if(n % 100 == 0) neighbors.broadcast(\"q\", {.x = 1, .y = 2})\n \
         neighbors.broadcast(\"r\", n) }\n",
    );
    let outcome = folder.bbz(&["sim", "s.toml", "--headless"]);
    let lines = outcome.stdout.lines().filter(|line| line.starts_with("message "));
    let expected = [
        "message s.bzz:3 broadcast \"p\": 4 frames; 3 robots take at most 3 % of the air",
        "message s.bzz:4 broadcast \"q\": 4 frames; 3 robots take at most 1 % of the air",
    ];
    assert!(lines.eq(expected), "{}", outcome.stdout);
}

#[test]
fn an_expectation_that_fails_is_status_1() {
    let folder = folder("sim_fails");
    folder.write("s.toml", SCENARIO.replace("equals = 19", "equals = 20"));
    let outcome = folder.bbz(&["sim", "s.toml", "--headless"]);
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(1), ""));
    assert!(outcome.stdout.contains("FAILED  s.toml:10:"), "{}", outcome.stdout);
    assert!(outcome.stdout.contains("  robot 0 had 19\n"), "{}", outcome.stdout);
    assert!(
        outcome.stdout.contains("global.n at the end: 19 to 19, mean 19\n"),
        "{}",
        outcome.stdout
    );
    assert!(!outcome.stdout.contains("five"), "{}", outcome.stdout);
}

/// What a robot has no room for is lost, and the summary names the key of the robot file.
#[test]
fn lost_messages_are_shown_with_the_key_that_gives_more_room() {
    let folder = folder("sim_lost");
    let listen = "function init() { neighbors.listen(\"t\", function(t, v, r) { }) }\n";
    let step = "function step() { neighbors.broadcast(\"t\", {.a = id, .b = 2}) }\n";
    folder.write("s.bzz", [listen, step].concat());
    folder.write(
        "s.toml",
        "[world]\nsize = [900, 900]\nduration = 20\n\
         [[robots]]\nrobot = \"zooids\"\nscript = \"s.bzz\"\ncount = 16\n",
    );
    let outcome = folder.bbz(&["sim", "s.toml", "--headless"]);
    let shown = outcome.stdout;
    assert!(shown.contains(" incomplete (more room: `in_long` of the robot file)\n"), "{shown}");
    assert!(shown.contains(", 0 before they were read\n"), "{shown}");
}

#[test]
fn a_fault_is_status_1_with_file_and_line() {
    let folder = folder("sim_fault");
    folder.write(
        "s.bzz",
        "n = 0\nfunction step() {\n  n = n + 1\n  if(n == 19) led(n / (id - 1))\n}\n",
    );
    let outcome = folder.bbz(&["sim", "s.toml"]);
    assert_eq!(outcome.status, Some(1));
    let stopped = "robot 1 stopped at 1.9 s, to start again after 1 s";
    outcome.reports(&["error[R0005]", "--> s.bzz:4:", stopped, "in `step`"]);
    let counted = "scripts stopped by an error: 1, started again: 0\n";
    assert!(outcome.stdout.contains(counted), "{}", outcome.stdout);
    // A program reads the same words.
    let json: Value =
        serde_json::from_str(&folder.bbz(&["sim", "s.toml", "--json"]).stdout).unwrap();
    let fault = &json["faults"][0];
    assert_eq!((&fault["code"], &fault["line"]), (&"R0005".into(), &4.into()));
    assert_eq!(fault["message"], "integer division by zero");
    assert_eq!(fault["help"], "test the divisor first, as in `if(n != 0)`");
    assert_eq!(fault["calls"][0]["function"], "step");
    // The same fault of many robots is printed once.
    folder.write("s.bzz", "n = 0\nfunction step() { n = n + 1 if(n == 9) led(1 / 0) }\n");
    let outcome = folder.bbz(&["sim", "s.toml"]);
    assert_eq!(outcome.stderr.matches("error[").count(), 1, "{}", outcome.stderr);
    outcome.reports(&["robot 0 stopped at 0.9 s, to start again after 1 s, and 2 others"]);
    let seconds = ["--set", "world.duration=4"];
    let outcome = folder.bbz(&[&["sim", "s.toml"], &seconds[..]].concat());
    outcome.reports(&["and 2 others; 6 times in all"]);
    let counted = "scripts stopped by an error: 6, started again: 3\n";
    assert!(outcome.stdout.contains(counted), "{}", outcome.stdout);
    folder.write("s.bzz", "n = 0\nfunction step() { n = n + 1 assert(n < 9) }\n");
    let outcome = folder.bbz(&["sim", "s.toml"]);
    outcome.reports(&["robot 0 stopped at 0.9 s, and 2 others"]);
}

#[test]
fn a_script_that_an_event_loads_has_its_own_names_and_lines() {
    let folder = folder("sim_load");
    folder.write("s.bzz", "n = 0\nfunction step() { n = n + 1 if(n == 9) log(\"before\") }\n");
    folder.write(
        "other.bzz",
        "# Line 1\nm = 0\nfunction step() {\n  m = m + 1\n  if(m == 3) log(\"after\")\n  if(m == 4) led(m / 0)\n}\n",
    );
    let scenario = std::fs::read_to_string(folder.path("s.toml")).unwrap();
    folder.write("s.toml", &(scenario + "\n[[event]]\nat = 1\nload = 1\nscript = \"other.bzz\"\n"));
    let outcome = folder.bbz(&["sim", "s.toml"]);
    assert_eq!(outcome.status, Some(1));
    outcome.reports(&["--> other.bzz:6:", "robot 1 stopped at 1.4 s"]);
    for line in ["     0.9     1  before\n", "     1.3     1  after\n"] {
        assert!(outcome.stdout.contains(line), "{line}: {}", outcome.stdout);
    }
    // The script is compiled before the run begins.
    folder.write("other.bzz", "function step() { fly() }\n");
    let outcome = folder.bbz(&["sim", "s.toml"]);
    assert_eq!(outcome.status, Some(2));
    outcome.reports(&["error[E0401]", "--> other.bzz:1:"]);
}

#[test]
fn questions_of_events_are_logged_and_their_errors_reported() {
    let folder = folder("sim_questions");
    folder.write(
        "s.bzz",
        "n = 0\nfunction add(x) { return n + x }\nfunction step() { n = add(1) }\n",
    );
    let scenario = std::fs::read_to_string(folder.path("s.toml")).unwrap();
    let question =
        |at, robots, text| format!("\n[[event]]\nat = {at}\nrobots = {robots}\nask = '{text}'\n");
    let questions = question(1.0, "[0, 2]", "add(1) * 2") + &question(1.5, "1", "add({})");
    folder.write("s.toml", &(scenario.clone() + &questions));
    let outcome = folder.bbz(&["sim", "s.toml"]);
    assert_eq!(outcome.status, Some(1));
    for line in ["     1.0     0  add(1) * 2 = 20\n", "     1.0     2  add(1) * 2 = 20\n"] {
        assert!(outcome.stdout.contains(line), "{line}: {}", outcome.stdout);
    }
    assert!(outcome.stdout.contains("     1.5     1  add({}): ended by an error\n"));
    outcome.reports(&[
        "error[R0001]",
        "--> s.bzz:2:",
        "a question to robot 1, or its listener or handler, ended at 1.5 s",
    ]);
    folder.write("s.toml", &(scenario + &question(1.0, "[0, 2]", "ad(1)")));
    let outcome = folder.bbz(&["sim", "s.toml"]);
    assert_eq!(outcome.status, Some(2));
    outcome.reports(&["there is no function `ad`; did you mean `add`?", "ask = 'ad(1)'"]);
}

#[test]
fn an_error_in_a_listener_is_status_1_unless_it_is_expected() {
    let folder = folder("sim_contained");
    folder.write(
        "s.bzz",
        "n = 0\nfunction init() {\n  neighbors.listen(\"x\", function(topic, value, robot) { n = n + value })\n}\n\
         function step() { if(id == 0) neighbors.broadcast(\"x\", nil) }\n",
    );
    let near = SCENARIO.replace("count = 3", "count = 3\nplacement = \"grid\"\nspacing = 60");
    let near = near.replace("equals = 19", "equals = 0");
    folder.write("s.toml", &near);
    let outcome = folder.bbz(&["sim", "s.toml"]);
    assert_eq!(outcome.status, Some(1));
    let note = "a listener or handler of robot 1 ended at ";
    outcome.reports(&[
        "error[R0001]",
        "--> s.bzz:3:",
        note,
        "s, its script went on, and another one",
    ]);
    assert!(
        outcome.stdout.contains("listeners and handlers ended by an error: "),
        "{}",
        outcome.stdout
    );
    let outcome = folder.bbz(&["sim", "s.toml", "--json"]);
    let json: Value = serde_json::from_str(&outcome.stdout).unwrap();
    assert_eq!(json["faults"][0]["consequence"], "contained");
    assert_eq!(json["errors"]["faults"], 0);
    assert!(json["errors"]["handler_faults"].as_u64() >= Some(2), "{json}");
    let expect = "[[expect]]\nat = 2\nvalue = \"handler_faults\"\nof = 2\nabove = 0\n";
    folder.write("s.toml", near + expect);
    assert_eq!(folder.bbz(&["sim", "s.toml"]).status, Some(0));
}

/// The third step of robot 1 begins in tick 3 and never ends; the steps of ticks 4 to 19 are
/// skipped.
#[test]
fn an_endless_step_is_reported() {
    let folder = folder("sim_endless");
    folder.write(
        "s.bzz",
        "n = 0\nfunction step() {\n  n = n + 1\n  if(n == 3 and id == 1)\n    while(1) n = 4 # bbz: allow(W0313)\n}\n",
    );
    let scenario = SCENARIO.split("[[expect]]").next().unwrap_or_default();
    let expect = "[[expect]]\nat = 2\nvalue = \"overruns\"\nof = \"sum\"\nequals = 16\n";
    folder.write("s.toml", scenario.to_owned() + expect);
    let outcome = folder.bbz(&["sim", "s.toml"]);
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
    let line = "steps left out because one before took too long: 16, by 1 robot; first by robot 1 at 0.4 s in s.bzz:5\n";
    assert!(outcome.stdout.contains(line), "{}", outcome.stdout);
    let outcome = folder.bbz(&["sim", "s.toml", "--json"]);
    let json: Value = serde_json::from_str(&outcome.stdout).unwrap();
    assert_eq!(
        (json["overruns"]["missed"].as_u64(), json["overruns"]["robots"].as_u64()),
        (Some(16), Some(1))
    );
    let first = &json["overruns"]["first"];
    assert_eq!((first["robot"].as_u64(), first["time"].as_f64()), (Some(1), Some(0.4)));
    assert_eq!((first["file"].as_str(), first["line"].as_u64()), (Some("s.bzz"), Some(5)));
    folder.bbz(&["sim", "s.toml", "--runs", "2", "--csv", "runs.csv"]);
    let table = String::from_utf8(folder.read("runs.csv")).unwrap();
    let mut rows = table.split_terminator("\r\n").map(|row| row.split(',').collect::<Vec<_>>());
    let column = rows.next().unwrap().iter().position(|name| *name == "overruns").unwrap();
    assert_eq!(rows.map(|row| row[column].to_owned()).collect::<Vec<_>>(), ["16", "16"]);
    // Scripts without overruns have no line.
    folder.write("s.bzz", SCRIPT);
    let outcome = folder.bbz(&["sim", "s.toml"]);
    assert!(!outcome.stdout.contains("left out"), "{}", outcome.stdout);
}

#[test]
fn mistakes_of_scenario_or_script_are_status_2() {
    let folder = folder("sim_wrong");
    folder.write("s.toml", SCENARIO.replace("count", "cuont").replace("size", "seize"));
    folder.bbz(&["sim", "s.toml"]).fails_with(
        2,
        &[
            "unknown key `cuont`",
            "s.toml:7:1",
            "did you mean `count`?",
            "unknown key `seize`",
            "s.toml:2:1",
        ],
    );
    folder.write("s.toml", SCENARIO.replace("global.n\"\nequals", "global.m\"\nequals"));
    folder.bbz(&["sim", "s.toml"]).fails_with(2, &["no script has a global `m`", "s.toml:12:9"]);
    folder.write("s.toml", SCENARIO);
    folder.write("s.bzz", "function step() { led(1, 2, 3, 4) }\n");
    folder.bbz(&["sim", "s.toml"]).fails_with(2, &["error[E", "s.bzz:1:", "led"]);
    folder.write("s.bzz", SCRIPT);
    folder
        .bbz(&["sim", "s.toml", "--set", "medium.ir.loss=2"])
        .fails_with(2, &["`loss` cannot be 2", "--set medium.ir.loss"]);
    folder.write("s.toml", SCENARIO.replace("[500, 500]", "[60, 60]"));
    folder.bbz(&["sim", "s.toml"]).fails_with(
        2,
        &[
            "random placement found no room for 3 robots",
            "s.toml:4:",
            "even a grid with spacing = 33 holds only 1",
        ],
    );
}

#[test]
fn a_wrong_command_line_is_status_3() {
    let folder = folder("sim_usage");
    folder.bbz(&["sim", "ss.toml"]).fails_with(3, &["there is no file `ss.toml`", "`s.toml`?"]);
    folder.bbz(&["sim", "."]).fails_with(3, &["folder"]);
    folder.bbz(&["sim"]).fails_with(3, &["<SCENARIO>"]);
    folder.bbz(&["sim", "s.toml", "--set", "world.seed"]).fails_with(3, &["gives no value"]);
    folder.bbz(&["sim", "s.toml", "--runs", "0"]).fails_with(3, &["--runs"]);
    folder.bbz(&["sim", "s.toml", "--record", "a", "--runs", "2"]).fails_with(3, &["--record"]);
    folder.bbz(&["sim", "s.toml", "--record", "no/such/file"]).fails_with(3, &["cannot write"]);
    folder.bbz(&["sim", "s.toml", "--csv", "no/such/file"]);
    let several = ["sim", "s.toml", "--view", "--set", "world.seed=1,2"];
    folder.bbz(&several).fails_with(3, &["`--view` shows one run", "one value"]);
    folder.bbz(&["sim", "s.toml", "--view", "--runs", "2"]).fails_with(3, &["--runs"]);
}

#[test]
fn json_is_one_object() {
    let folder = folder("sim_json");
    let outcome = folder.bbz(&["sim", "s.toml", "--json", "--seed", "9"]);
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
    let result: Value = serde_json::from_str(&outcome.stdout).unwrap();
    assert_eq!(result["success"], true);
    assert_eq!(result["seed"], 9);
    assert_eq!(result["expects"][0]["since"], 2.0);
    assert_eq!(result["expects"][0]["against"], Value::Null);
    assert_eq!(
        result["plot"],
        serde_json::json!({ "global.n": { "mean": 19.0, "min": 19.0, "max": 19.0 } })
    );
    assert_eq!(result["faults"], serde_json::json!([]));
    let digest = |seed: &str| {
        let outcome = folder.bbz(&["sim", "s.toml", "--json", "--seed", seed]);
        serde_json::from_str::<Value>(&outcome.stdout).unwrap()["digest"].clone()
    };
    assert_eq!(digest("9"), result["digest"]);
    assert_ne!(digest("10"), result["digest"]);
}

#[test]
fn recordings_and_pictures_are_written() {
    let folder = folder("sim_files");
    let outcome = folder.bbz(&["sim", "s.toml", "--record", "run.bbr", "--svg", "pictures"]);
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
    assert!(folder.read("run.bbr").starts_with(b"bbzrec\x04"));
    for picture in ["pictures/trajectories.svg", "pictures/global-n.svg"] {
        assert!(folder.read(picture).starts_with(b"<svg "), "{picture}");
    }
}

/// The run would take four weeks, and is interrupted.
#[cfg(unix)]
#[test]
fn a_signal_ends_a_run_with_a_summary_and_a_whole_recording() {
    use std::io::{BufRead, BufReader, Read};

    use bittybuzz_arena::output::recording::RecordingReader;

    for signal in ["-INT", "-TERM"] {
        let folder = folder(&format!("sim{signal}"));
        folder.write("s.toml", SCENARIO.replace("duration = 2", "duration = 2419200"));
        let set = ["--set", "expect.0.at=2419200"];
        let arguments = [&["sim", "s.toml", "--record", "run.bbr"], &set[..]].concat();
        let mut child = folder.command(&arguments).spawn().unwrap();
        let mut stdout = BufReader::new(child.stdout.take().unwrap());
        let mut printed = String::new();
        stdout.read_line(&mut printed).unwrap();
        assert_eq!(printed, "     0.5     1  five 5\n");
        let kill = [signal, &child.id().to_string()];
        assert!(std::process::Command::new("kill").args(kill).status().unwrap().success());
        let outcome = support::finish(child);
        assert_eq!(outcome.status, Some(1), "{signal}");
        outcome.reports(&["stopped by Ctrl-C or SIGTERM at", "of 2419200 s"]);
        stdout.read_to_string(&mut printed).unwrap();
        assert!(printed.contains("OPEN    s.toml:10:"), "{printed}");
        let recording = folder.read("run.bbr");
        assert!(RecordingReader::new(&recording).unwrap().all(|sample| sample.is_ok()), "{signal}");
    }
}

#[test]
fn a_lack_of_memory_names_the_globals_that_hold_it() {
    let folder = folder("sim_memory");
    folder.write(
        "s.toml",
        "[world]\nsize = [500, 500]\nduration = 2\n\
         [[robots]]\nrobot = \"kilobot\"\nscript = \"s.bzz\"\nplacement = \"line\"\nspacing = 40\ncount = 2\n",
    );
    let globals = "few = { .1 = 1 }\nmany = {}\nn = 0\n";
    let fill = "while(1) {\n  n = n + 1\n  many[n] = { .x = n }\n}\n";
    let step = format!("{globals}function step() {{\n{fill}}}\n");
    // The listener of a robot ends, and its script goes on.
    let listener = format!(
        "{globals}function f(topic, value, robot) {{\n{fill}}}\n\
         function init() {{ neighbors.listen(\"go\", f) }}\n\
         function step() {{ if(id == 0) neighbors.broadcast(\"go\", 1) }}\n"
    );
    for (script, robot) in [(step, "robot 0 stopped"), (listener, "a listener or handler")] {
        folder.write("s.bzz", script);
        let outcome = folder.bbz(&["sim", "s.toml"]);
        let all = &outcome.stderr;
        for words in ["R0010", robot, "globals and calls take ", "`many` holds ", "`few` holds 7"] {
            assert!(all.contains(words), "{words}: {all}");
        }
    }
}

/// One script for different robots can test for the functions that a robot may lack.
#[test]
fn a_script_knows_the_functions_of_all_robots_of_its_scenario() {
    let folder = folder("sim_unlike");
    let robot = |name: &str, function: &str| {
        format!(
            "name = \"{name}\"\n[body]\ndrive = \"unicycle\"\nradius_mm = 40\nspeed_mm_s = 50\n\
             turn_deg_s = 90\n[[function]]\nname = \"{function}\"\naccepts = [\"x: int\"]\n\
             sets = {{ color = \"x\" }}\nhelp = \"shines\"\n"
        )
    };
    folder.write("a.toml", robot("ant", "glow"));
    folder.write("b.toml", robot("bee", "flash"));
    folder.write("s.bzz", "function step() {\n  if(glow) glow(1)\n  if(flash) flash(2)\n}\n");
    folder.write(
        "s.toml",
        "[world]\nsize = [500, 500]\nduration = 1\n\
         [[robots]]\nrobot = \"a.toml\"\nscript = \"s.bzz\"\ncount = 2\n\
         [[robots]]\nrobot = \"b.toml\"\nscript = \"s.bzz\"\ncount = 2\n\
         [[expect]]\nat = 1\nrobots = \"ant\"\nvalue = \"led\"\nequals = 1\n\
         [[expect]]\nat = 1\nrobots = \"bee\"\nvalue = \"led\"\nequals = 2\n",
    );
    let outcome = folder.bbz(&["sim", "s.toml"]);
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""), "{}", outcome.stdout);
}
