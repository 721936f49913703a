//! Mistakes in a command line have clear messages and exit status 3; `--help` prints the help.

use crate::support;
use crate::support::Folder;
use serde_json::Value;

#[test]
fn help_has_examples_and_goes_to_standard_output() {
    let folder = Folder::new("help");
    for command in ["check", "build", "run", "trace", "flash", "disasm"] {
        let outcome = folder.bbz(&[command, "--help"]);
        assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
        for part in ["Examples:", &format!("\n  bbz {command} "), "Usage:", "--robot"] {
            assert!(outcome.stdout.contains(part), "{command}: {}", outcome.stdout);
        }
    }
    let outcome = folder.bbz(&["--help"]);
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
    assert!(outcome.stdout.contains("Examples:"));
    assert_eq!(folder.bbz(&["--version"]).status, Some(0));
}

#[test]
fn explain_explains_any_code_and_lists_all() {
    let folder = Folder::new("explain");
    for code in ["E0201", "w0102", "R0005"] {
        let outcome = folder.bbz(&["explain", code]);
        assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
        assert!(outcome.stdout.contains(&code.to_uppercase()), "{}", outcome.stdout);
        assert_eq!(outcome.stdout.matches("```buzz").count(), 1, "one section only");
    }
    let list = folder.bbz(&["explain"]);
    assert_eq!((list.status, list.stderr.as_str()), (Some(0), ""));
    for code in list.stdout.lines().filter_map(|line| line.split_whitespace().next()) {
        assert_eq!(folder.bbz(&["explain", code]).status, Some(0), "{code}");
    }
    folder.bbz(&["explain", "R00055"]).fails_with(3, &["`R00055`", "did you mean R0005?"]);
    folder.bbz(&["explain", "nonsense"]).fails_with(3, &["`nonsense`", "bbz explain"]);
    assert!(folder.bbz(&["explain", "--help"]).stdout.contains("Examples:\n  bbz explain "));
}

#[test]
fn every_shell_gets_completions() {
    let folder = Folder::new("completions");
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let outcome = folder.bbz(&["completions", shell]);
        assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
        for word in ["explain", "robot", "seed"] {
            assert!(outcome.stdout.contains(word), "{shell}: {word}");
        }
    }
    folder.bbz(&["completions", "csh"]).fails_with(3, &["csh", "bash"]);
}

#[test]
fn every_command_has_a_manual_page() {
    let folder = Folder::new("manual");
    assert_eq!(folder.bbz(&["manual", "."]).status, Some(0));
    for (page, part) in
        [("bbz.1", "Exit status"), ("bbz-sim.1", "seed"), ("bbz-explain.1", "E0201")]
    {
        let text = String::from_utf8(folder.read(page)).unwrap();
        assert!(text.contains(".TH") && text.contains(part), "{page}: {text}");
    }
    folder.bbz(&["manual", "nowhere"]).fails_with(3, &["cannot write `nowhere`"]);
}

#[test]
fn wrong_options_are_usage_errors() {
    let folder = Folder::with("options", "s.bzz", "log(1)\n");
    let cases: [(&[&str], &[&str]); 10] = [
        (&[], &["Usage"]),
        (&["fly"], &["fly"]),
        (&["run"], &["FILE"]),
        (&["run", "s.bzz", "--steps", "abc"], &["--steps", "abc"]),
        (&["run", "s.bzz", "--steps", "-1"], &["-1"]),
        (&["run", "s.bzz", "--id", "70000"], &["--id", "70000"]),
        (&["run", "s.bzz", "--profile", "huge"], &["huge", "tiny", "full"]),
        (&["run", "s.bzz", "--robot", "zooid"], &["zooid", "did you mean `zooids`?"]),
        (&["run", "s.bzz", "--robot", "none.toml"], &["none.toml"]),
        (&["run", "s.bzz", "t.bzz"], &["t.bzz"]),
    ];
    for (arguments, parts) in cases {
        folder.bbz(arguments).fails_with(3, parts);
    }
}

#[test]
fn numbers_that_do_not_fit_are_named() {
    let folder = Folder::with("numbers", "script.bzz", "log(1)\n");
    folder.bbz(&["run", "--steps", "-1", "script.bzz"]).fails_with(3, &["'-1' for '--steps <N>'"]);
    folder.bbz(&["run", "--neighbor", "2", "script.bzz"]).fails_with(3, &["an id and a distance"]);
}

#[test]
fn files_that_cannot_be_read_are_usage_errors() {
    let folder = Folder::with("files", "script.bzz", "log(1)\n");
    folder.write("notes.txt", "");
    folder.write("none", "");
    std::fs::create_dir(folder.path("folder.bzz")).unwrap();
    for command in ["check", "run", "disasm"] {
        folder
            .bbz(&[command, "scrip.bzz"])
            .fails_with(3, &["there is no file `scrip.bzz`", "did you mean `script.bzz`?"]);
        folder.bbz(&[command, "no/such.bzz"]).fails_with(3, &["no/such.bzz"]);
        folder.bbz(&[command, "folder.bzz"]).fails_with(3, &["`folder.bzz` is a folder"]);
        folder.bbz(&[command, "notes.txt"]).fails_with(3, &["notes.txt", ".bzz", ".bbi"]);
        folder.bbz(&[command, "none"]).fails_with(3, &["`none`", ".bzz"]);
    }
}

#[cfg(unix)]
#[test]
fn a_file_without_permission() {
    use std::os::unix::fs::PermissionsExt;
    let folder = Folder::with("permission", "s.bzz", "log(1)\n");
    let closed = std::fs::Permissions::from_mode(0o000);
    std::fs::set_permissions(folder.path("s.bzz"), closed).unwrap();
    // The superuser may read everything.
    if std::fs::read(folder.path("s.bzz")).is_err() {
        folder.bbz(&["run", "s.bzz"]).fails_with(3, &["permission", "s.bzz"]);
    }
}

#[test]
fn an_empty_script_is_a_script_and_an_empty_image_is_none() {
    let folder = Folder::with("empty", "s.bzz", "");
    folder.write("s.bbi", "");
    folder.bbz(&["run", "s.bzz"]).succeeds_with("");
    folder.bbz(&["check", "s.bzz"]).succeeds_with("");
    folder.bbz(&["run", "s.bbi"]).fails_with(3, &["s.bbi", "cut off"]);
}

#[test]
fn images_that_are_none_are_refused() {
    let folder =
        Folder::with("refused", "s.bzz", "function init() { log(math.sqrt(2)) }\nled(1)\n");
    assert_eq!(folder.bbz(&["build", "s.bzz", "--robot", "zooids"]).status, Some(0));
    std::fs::remove_file(folder.path("s.sym")).unwrap();
    let good = folder.read("s.bbi");
    let changed = |at: usize, byte: u8| {
        let mut bytes = good.clone();
        bytes[at] = byte;
        bytes
    };
    for (bytes, reason) in [
        (b"log(1)\n".to_vec(), "is not an image"),
        (changed(1, good[1] & 0xf0 | 1), "version 1, older than version 2"),
        (good[..good.len() - 1].to_vec(), "is damaged"),
        (good[..9].to_vec(), "is cut off"),
    ] {
        folder.write("bad.bbi", &bytes);
        folder.bbz(&["run", "bad.bbi"]).fails_with(3, &["`bad.bbi`", reason]);
    }
    // The image is correct, but for another robot.
    folder.write("car.toml", CAR);
    folder.bbz(&["run", "s.bbi", "--robot", "car.toml"]).fails_with(3, &["function", "robot"]);
}

/// A robot without functions.
const CAR: &str = "name = \"car\"\ntitle = \"Car\"\nprofile = \"tiny\"\ntick_hz = 10\nmessage_bytes = 9\n\
    [vm]\nmemory = 2000\nslots = 300\nneighbors = 4\nin_queue = 4\nout_queue = 4\n\
    stigmergy_entries = 2\nswarms = 2\n";

#[test]
fn a_mistake_in_a_robot_file_has_a_place() {
    let folder = Folder::with("robot_file", "s.bzz", "");
    folder.write("car.toml", CAR.replace("tick_hz = 10", "tick_hz = 0"));
    folder
        .bbz(&["check", "s.bzz", "--robot", "car.toml"])
        .fails_with(3, &["car.toml:4:", "tick_hz", "from 1 to 100"]);
    folder.write("car.toml", CAR.replace("tick_hz = 10", "tick_hz = 0").replace("\"car\"", "3"));
    folder.bbz(&["check", "s.bzz", "--robot", "car.toml"]).fails_with(
        3,
        &["car.toml:1:", "`name` must be a string", "car.toml:4:", "`tick_hz` cannot be 0"],
    );
}

#[test]
fn check_reports_all_mistakes_and_only_errors_count() {
    let folder = Folder::with("check", "s.bzz", "log(1\nlog(2))\n");
    folder.bbz(&["check", "s.bzz"]).fails_with(2, &["error[E", "s.bzz:"]);
    folder.write("s.bzz", "log(unknown_thing)\n");
    let warned = folder.bbz(&["check", "s.bzz"]);
    assert_eq!((warned.status, warned.stdout.as_str()), (Some(0), ""));
    warned.reports(&["warning[W", "s.bzz:1:5"]);
}

#[test]
fn check_without_a_robot_knows_the_functions_of_all() {
    let folder = Folder::with("check_robots", "s.bzz", "takeoff(100)\nset_motor(1, 2)\n");
    folder.bbz(&["check", "s.bzz"]).succeeds_with("");
    folder.bbz(&["check", "s.bzz", "--robot", "crazyflie"]).succeeds_with("");
    folder.bbz(&["check", "s.bzz", "--robot", "kilobot"]).fails_with(2, &["takeoff", "s.bzz:1:1"]);
}

#[test]
fn check_knows_the_profile() {
    let folder = Folder::with("check_profile", "s.bzz", "x = 40000\n");
    folder.bbz(&["check", "s.bzz"]).succeeds_with("");
    folder.bbz(&["check", "s.bzz", "--robot", "kilobot"]).fails_with(2, &["40000", "s.bzz:1:5"]);
    folder.bbz(&["check", "s.bzz", "--profile", "tiny"]).fails_with(2, &["40000"]);
    folder.bbz(&["check", "s.bzz", "--robot", "kilobot", "--profile", "full"]).succeeds_with("");
}

#[test]
fn check_json_is_one_object_on_standard_output() {
    let folder = Folder::with("check_json", "s.bzz", "log(\"\u{e9}\u{1}\ny = unknown_thing\n");
    for text in ["", "log(unknown_thing)\n", "log(\"\u{e9}\u{1}\"\nx = )\n"] {
        folder.write("s.bzz", text);
        let outcome = folder.bbz(&["check", "s.bzz", "--json"]);
        assert_eq!(outcome.stderr, "");
        assert_eq!(outcome.stdout.lines().count(), 1);
        let result: Value = serde_json::from_str(&outcome.stdout).unwrap();
        let count = |name: &str| result[name].as_u64().unwrap();
        let diagnostics = result["diagnostics"].as_array().unwrap();
        assert_eq!(count("errors") + count("warnings"), diagnostics.len() as u64);
        assert_eq!(outcome.status, Some(if count("errors") == 0 { 0 } else { 2 }));
        for diagnostic in diagnostics {
            assert!(
                diagnostic["message"].is_string() && diagnostic["line"].is_u64(),
                "{diagnostic}"
            );
        }
    }
}

#[test]
fn only_scripts_can_be_checked_and_built() {
    let folder = Folder::with("only_scripts", "s.bbi", "");
    folder.bbz(&["check", "s.bbi"]).fails_with(3, &["s.bbi", ".bzz"]);
    folder.bbz(&["build", "s.bbi", "--robot", "kilobot"]).fails_with(3, &["s.bbi", ".bzz"]);
}

#[test]
fn colors_are_for_terminals_only() {
    let folder = Folder::with("colors", "s.bzz", "log(1 +)\n");
    assert!(!folder.bbz(&["run", "s.bzz"]).stderr.contains('\u{1b}'));
    let forced = folder.command(&["run", "s.bzz"]).env("CLICOLOR_FORCE", "1").spawn();
    assert!(support::finish(forced.unwrap()).stderr.contains('\u{1b}'));
    let refused = folder.command(&["run", "s.bzz"]).env("NO_COLOR", "1").spawn();
    assert!(!support::finish(refused.unwrap()).stderr.contains('\u{1b}'));
}

/// A full disk under the log of standard error does not change how a command ends.
#[test]
fn standard_error_that_cannot_be_written_is_no_failure() {
    let Ok(full) = std::fs::File::options().write(true).open("/dev/full") else { return };
    let folder = Folder::with("full_stderr", "wrong.bzz", "x = \n");
    folder.write("fault.bzz", "function step() { x = nil + 1 }\n");
    folder.write("warning.bzz", "function f() { var a = 1 }\n");
    for (arguments, status) in [
        (&["check", "wrong.bzz"][..], 2),
        (&["check", "warning.bzz"], 0),
        (&["run", "fault.bzz", "--steps", "2"], 1),
        (&["run", "none.bzz"], 3),
        (&["run", "--no-such-option"], 3),
    ] {
        let mut command = folder.command(arguments);
        let child = command.stderr(full.try_clone().unwrap()).spawn().unwrap();
        assert_eq!(support::finish(child).status, Some(status), "{arguments:?}");
    }
}

#[test]
fn the_number_of_messages_is_limited() {
    let errors: String = (0..123).map(|number| format!("f{number}()\n")).collect();
    let folder = Folder::with("many_messages", "s.bzz", &(warnings_of(101) + &errors));
    let outcome = folder.bbz(&["check", "s.bzz"]);
    let count = |level: &str| outcome.stderr.lines().filter(|line| line.starts_with(level)).count();
    assert_eq!((outcome.status, count("error"), count("warning")), (Some(2), 100, 100));
    assert!(
        outcome.stderr.ends_with(
            "note: 23 more errors and 1 more warning are not shown\n\
             note: 123 errors and 101 warnings; `bbz explain E0401` explains\n"
        ),
        "{}",
        outcome.stderr
    );
    let all: serde_json::Value =
        serde_json::from_str(&folder.bbz(&["check", "s.bzz", "--json"]).stdout).unwrap();
    assert_eq!(all["diagnostics"].as_array().map(Vec::len), Some(224));
    folder.write("one.bzz", warnings_of(101));
    let outcome = folder.bbz(&["check", "one.bzz"]);
    assert!(
        outcome.stderr.ends_with(
            "note: 1 more warning is not shown\n\
             note: 101 warnings; `bbz explain W0201` explains\n"
        ),
        "{}",
        outcome.stderr
    );
}

fn warnings_of(count: usize) -> String {
    (0..count).map(|number| format!("x = unset{number}\n")).collect()
}

/// A search compares all names of the script, so a search for each unknown name takes quadratic
/// time.
#[test]
fn likely_names_are_searched_for_the_first_unknown_ones() {
    let text = format!("length = 1\n{}", "lenght()\n".repeat(150));
    let folder = Folder::with("unknown_names", "s.bzz", &text);
    let outcome = folder.bbz(&["check", "s.bzz", "--json"]);
    let all: serde_json::Value = serde_json::from_str(&outcome.stdout).unwrap();
    let helps: Vec<&serde_json::Value> =
        all["diagnostics"].as_array().unwrap().iter().map(|one| &one["help"]).collect();
    assert_eq!((outcome.status, helps.len()), (Some(2), 150));
    assert!(helps[..100].iter().all(|help| *help == "did you mean `length`?"), "{helps:?}");
    assert!(helps[100..].iter().all(|help| help.is_null()), "{helps:?}");
}

/// A robot that the simulator moves according to its robot file.
const ROVER: &str = r#"name = "rover"

[body]
drive = "unicycle"
radius_mm = 40
speed_mm_s = 100
turn_deg_s = 90

[[sensor]]
name = "eyes"
kind = "proximity"
count = 4
range_mm = 300

[[function]]
name = "go"
accepts = ["speed: number"]
sets = { forward = "speed cm/s", turn = 0 }
help = "go ahead"

[[function]]
name = "behind"
accepts = [""]
returns = "int"
reads = "eyes.2"
help = "distance to what is in the back"

[[function]]
name = "say"
accepts = ["values: any..."]
logs = true
help = "write the values to the log"
"#;

#[test]
fn robots_are_listed_with_their_functions() {
    let folder = Folder::new("robots");
    let list = folder.bbz(&["robots"]).stdout;
    for name in ["kilobot", "zooids", "crazyflie", "footbot", "epuck", "khepera", "hiveboard"] {
        assert!(list.lines().any(|line| line.starts_with(name)), "{list}");
    }
    let kilobot = folder.bbz(&["robots", "kilobot"]).stdout;
    for line in [
        "Kilobot (`--robot kilobot`): ATmega328P",
        "  azimuth and elevation of neighbors are nil",
        "led(color: int 0..7)",
        "led(red: int 0..3, green: int 0..3, blue: int 0..3)",
        "    duty of each vibration motor, 0 to 255; a motor that starts is spun up for 15 ms first",
        "battery(): int",
    ] {
        assert!(kilobot.lines().any(|found| found == line), "{line} is not in:\n{kilobot}");
    }
    let zooids = folder.bbz(&["robots", "zooids"]).stdout;
    assert!(zooids.contains("\npos = { "), "{zooids}");
    assert!(zooids.contains("\nbbz flash --set range_mm="), "{zooids}");
    assert!(!zooids.contains("in bbz sim"), "{zooids}");
    let footbot = folder.bbz(&["robots", "footbot"]).stdout;
    for line in [
        "Foot-bot (`--robot footbot`): never flashed",
        "  along a vector: at most 100 mm/s; straight up to 10 degrees off, on the spot above 90 until 70, else in a curve",
        "  sensor light: light, 24 directions, 0 to 1023",
        "  sensor range_and_bearing: range-and-bearing, up to 3000 mm; scripts get distances in cm",
        "    in bbz sim: steers along forward = 10 * x mm/s, leftward = 10 * y mm/s",
        "    in bbz sim: logs the call",
    ] {
        assert!(footbot.lines().any(|found| found == line), "{line} is not in:\n{footbot}");
    }
    folder.write("rover.toml", ROVER);
    let rover = folder.bbz(&["robots", "rover.toml"]).stdout;
    for line in [
        "  body in bbz sim: unicycle, radius 40 mm, height 80 mm; at most forward 100 mm/s, turn 90 deg/s",
        "  sensor eyes: proximity, 4 beams up to 300 mm",
        "go(speed: number)",
        "    in bbz sim: sets forward = 10 * speed mm/s, turn = 0 deg/s",
        "    in bbz sim: reads eyes.2 (mm)",
        "say(values: any...)",
        "    in bbz sim: logs its arguments",
    ] {
        assert!(rover.lines().any(|found| found == line), "{line} is not in:\n{rover}");
    }
    let unknown = folder.bbz(&["robots", "kilobots"]);
    assert_eq!(unknown.status, Some(3));
    assert!(unknown.stderr.contains("no robot is named `kilobots`"), "{}", unknown.stderr);
}
