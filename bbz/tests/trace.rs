//! `bbz trace`: prints a robot's messages in the form of `bbz run`.

use crate::support;
use crate::support::robot;
use std::io::Write;
use std::process::Stdio;

use crate::support::{Folder, Outcome};
use bittybuzz_comms::infrared::FaultReport;
use bittybuzz_comms::trace;
use bittybuzz_vm_core::{Fault, FaultCode, ImageError, Type};
use serde_json::Value;

/// Runs `bbz trace` with `lines` on standard input.
fn trace_lines(folder: &Folder, lines: &str, arguments: &[&str]) -> Outcome {
    let mut command = folder.command(&[&["trace", "-"], arguments].concat());
    let mut child = command.stdin(Stdio::piped()).spawn().unwrap();
    // bbz may end before it has read everything.
    let _ = child.stdin.take().unwrap().write_all(lines.as_bytes());
    support::finish(child)
}

/// A folder with a script and the files of `bbz build` for the Crazyflie.
fn built(test: &str, script: &str) -> Folder {
    let folder = Folder::with(test, "s.bzz", script);
    let outcome = folder.bbz(&["build", "s.bzz", "--robot", "crazyflie"]);
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    folder
}

fn log_of(folder: &Folder, steps: u32) -> String {
    robot::lines(&robot::records(&folder.read("s.bbi"), steps))
}

const LOGS: &str = "\
t = { .a = 1, .b = 2 }
log(nil, -7, 2.5, \"x\", t, log, {})
log()
function init() { log(\"\u{e9}\u{4e16}\", string.concat(\"made \", \"here\")) }
n = 0
function step() {
  n = n + 1
  log(\"step \", n, \" \", n / 4.0)
}
";

#[test]
fn plain_is_what_run_prints() {
    let folder = built("trace_plain", LOGS);
    let run = folder.bbz(&["run", "s.bzz", "--robot", "crazyflie", "--steps", "5"]);
    assert_eq!((run.status, run.stdout.lines().count()), (Some(0), 8));
    let lines = log_of(&folder, 5);
    for script in ["s.bzz", "s.bbi", "s.sym"] {
        trace_lines(&folder, &lines, &["--plain", "--script", script]).succeeds_with(&run.stdout);
    }
    trace_lines(&folder, &lines, &["--plain", "--symbols", "s.sym"]).succeeds_with(&run.stdout);
}

#[test]
fn text_has_time_and_step() {
    let folder = built("trace_text", "log(1)\nfunction step() { log(\"two\") }\n");
    let mut lines = String::from("Finished in 0.2s\n0.000100 INFO  boot\n");
    lines += &log_of(&folder, 2);
    let outcome = trace_lines(&folder, &lines, &["--script", "s.bzz"]);
    let hash = outcome.stdout.split("script ").nth(1).unwrap()[..8].to_owned();
    outcome.succeeds_with(&format!(
        "           - -         Finished in 0.2s\n    \
             0.000100 INFO      boot\n    \
             0.000000 start     robot 7 runs script {hash} (`s.bzz`)\n    \
             1.000000 step 0    1\n    \
             2.000000 step 0    two\n    \
             3.000000 step 1    two\n"
    ));
}

#[test]
fn a_fault_is_reported_as_by_run() {
    let cases = [
        "function half(x) {\n  return 10 / x\n}\nfunction outer(x) { return half(x) + 1 }\nfunction step() { log(outer(2 - 2)) }\n",
        "x = nil\nlog(x + 1)\n",
        "function f(n) { return f(n + 1) + 1 }\nf(0)\n",
        "assert(0 == 1, \"told you\")\n",
        "include \"vec2.bzz\"\nlog(math.vec2.length(nil))\n",
        "x = rand()\nfunction step() { x.y = 2 }\n",
    ];
    for (number, script) in cases.iter().enumerate() {
        let folder = built(&format!("trace_fault_{number}"), script);
        let run = folder.bbz(&["run", "s.bzz", "--robot", "crazyflie", "--steps", "3"]);
        assert_eq!(run.status, Some(1), "{script}");
        let lines = log_of(&folder, 3);
        for symbols in ["s.bzz", "s.sym"] {
            let outcome = trace_lines(&folder, &lines, &["--plain", "--script", symbols]);
            assert_eq!((outcome.status, &outcome.stdout), (Some(1), &run.stdout));
            // Only the time is printed in addition. A record has no room for every call of an
            // endless recursion.
            assert_eq!(outcome.stderr.matches("complete steps, at ").count(), 1);
            let (message, mut expected) = (essence(&outcome.stderr), essence(&run.stderr));
            expected.retain(|line| !line.starts_with("  = note: in step "));
            if !run.stderr.contains("more calls") {
                assert_eq!(message, expected);
            } else {
                assert_eq!(message.first(), expected.first());
            }
        }
    }
}

/// Returns the lines of a message without the time and separators.
fn essence(message: &str) -> Vec<&str> {
    let lines = message.lines();
    lines.filter(|line| line.trim() != "|" && !line.contains("complete steps, at ")).collect()
}

#[test]
fn a_refused_call_lists_the_accepted_arguments() {
    let folder = built("trace_refused_arguments", "log(1)\n");
    // The compiler would refuse the call, an image of another origin has it.
    folder.write("s.bzz", "f = led\nf()\n");
    folder.bbz(&["build", "s.bzz", "--robot", "crazyflie"]);
    let lines = log_of(&folder, 0);
    let outcome = trace_lines(&folder, &lines, &["--robot", "crazyflie", "--script", "s.bzz"]);
    assert_eq!(outcome.status, Some(1));
    outcome.reports(&["error[R0012]", "s.bzz:2:1"]);
}

#[test]
fn without_symbols_there_are_numbers() {
    let folder = built("trace_numbers", "log(\"text\", 1)\nlog(nil + id)\n");
    let outcome = trace_lines(&folder, &log_of(&folder, 0), &["--plain"]);
    assert_eq!(outcome.status, Some(1));
    let (before, after) = outcome.stdout.split_once("[string ").unwrap();
    assert!(before.is_empty() && after.ends_with("]1\n"), "{}", outcome.stdout);
    outcome.reports(&["--script names the script", "error[R0001]", "at position "]);
    assert_eq!(outcome.stderr.matches("--script").count(), 1);
    std::fs::remove_file(folder.path("s.sym")).unwrap();
    let outcome = trace_lines(&folder, &log_of(&folder, 0), &["--plain", "--script", "s.bbi"]);
    outcome.reports(&["no symbols (.sym) next to `s.bbi`", "cannot add nil and an integer"]);
}

#[test]
fn symbols_of_another_script_are_ignored() {
    let folder = built("trace_mismatch", "log(\"mine\")\nlog(nil + id)\n");
    let lines = log_of(&folder, 0);
    folder.write("s.bzz", "log(\"other\")\n");
    let outcome = trace_lines(&folder, &lines, &["--plain", "--script", "s.bzz"]);
    assert_eq!(outcome.status, Some(1));
    assert!(!outcome.stdout.contains("other"), "{}", outcome.stdout);
    outcome.reports(&[
        "warning: the robot runs script ",
        "`s.bzz` is script ",
        "shown as numbers",
        "bbz flash",
        "at position ",
    ]);
}

#[test]
fn a_trace_that_missed_the_start_has_one_note() {
    let folder = built("trace_late", "function step() { log(\"text\") }\n");
    let lines = log_of(&folder, 3);
    let (_, late) = lines.split_once('\n').unwrap();
    let outcome = trace_lines(&folder, late, &["--plain", "--script", "s.bzz"]);
    assert_eq!((outcome.status, outcome.stdout.as_str()), (Some(0), "text\ntext\ntext\n"));
    assert_eq!(outcome.stderr.matches("it is taken to run `s.bzz`").count(), 1);
}

#[test]
fn every_other_record_is_printed() {
    let folder = Folder::new("trace_words");
    let unused = trace::Unused { dropped: [7, 0], ..trace::Unused::default() };
    let records = [
        trace::overrun(4, 3).to_vec(),
        trace::expired(5).to_vec(),
        trace::lost(12).to_vec(),
        trace::unused(&unused).to_vec(),
        trace::restart(6, 25).to_vec(),
        trace::restart(6, 0).to_vec(),
    ];
    let lines = robot::lines(&records);
    let words = [
        "a step took longer than a tick: 3 ticks missed so far",
        "no step has ended for so long that the robot has stopped its motors",
        "12 log lines came faster than the robot could send them",
        "discarded messages so far: 7 received without room for it",
        "the script starts again in 2.5 s",
        "the script starts again",
    ];
    let subjects = ["step 4", "step 5", "lost", "unused", "step 6", "step 6"];
    let text = trace_lines(&folder, &lines, &[]);
    assert_eq!(text.status, Some(0));
    assert_eq!(text.stdout.lines().count(), words.len());
    for (line, (subject, words)) in text.stdout.lines().zip(subjects.iter().zip(words)) {
        assert!(line.contains(subject) && line.ends_with(words), "{line}");
    }
    let plain = trace_lines(&folder, &lines, &["--plain"]);
    assert_eq!((plain.status, plain.stdout.as_str()), (Some(0), ""));
    plain.reports(&words.map(|words| format!("warning: {words}")).each_ref().map(String::as_str));
}

/// Counts are printed once per second, and the last ones at the end.
#[test]
fn counts_of_discarded_messages_are_printed_once_per_second() {
    let folder = Folder::new("trace_unused");
    let line = |n: u16| {
        let unused = trace::Unused { dropped: [n, 0], ..Default::default() };
        format!("{}.{}00000 INFO  bbz {:?}\n", n / 10, n % 10, trace::unused(&unused).to_vec())
    };
    let lines: String = (1..=25).map(line).collect();
    let text = trace_lines(&folder, &lines, &[]);
    let reports = text.stdout.lines().filter_map(|line| line.split_once("messages so far: "));
    let counts: Vec<&str> = reports.filter_map(|(_, counts)| counts.split(' ').next()).collect();
    assert_eq!(counts, ["1", "11", "21", "25"]);
    let json = trace_lines(&folder, &lines, &["--json"]);
    assert_eq!(json.stdout.lines().count(), 25);
}

#[test]
fn a_refused_image_is_reported_as_by_build() {
    let folder = built("trace_refused", "log(1)\n");
    let mut image = folder.read("s.bbi");
    image.truncate(image.len() / 2);
    let refused = robot::lines(&robot::records(&image, 0));
    let outcome = trace_lines(&folder, &refused, &[]);
    outcome.fails_with(3, &["the script in the robot's flash is "]);
    // An earlier `bbz` has flashed this image: its version is in the lower half of the second byte.
    let mut old = folder.read("s.bbi");
    old[1] = old[1] & 0xf0 | 1;
    let refused = robot::lines(&robot::records(&old, 0));
    trace_lines(&folder, &refused, &[])
        .fails_with(3, &["version 1, older than version 2", "build it again"]);
    // Firmware of an earlier version refuses images of this `bbz`.
    let refused = robot::lines(&[trace::refused(ImageError::Version(2)).to_vec()]);
    trace_lines(&folder, &refused, &[]).fails_with(
        3,
        &["version 2", "its firmware is of another version", "build the firmware again"],
    );
    let empty = robot::lines(&robot::records(&[0xff; 64], 0));
    trace_lines(&folder, &empty, &[]).fails_with(3, &["is not an image", "`bbz flash` writes one"]);
}

#[test]
fn damaged_records_are_reported_and_skipped() {
    let folder = Folder::new("trace_damaged");
    let mut lines = String::new();
    let fault = [3, 1, 0, 0, 0, 99, 0, 0, 0, 0];
    for record in [&[][..], &[99], &[1], &[2, 1, 0], &[2, 0, 0, 0, 0, 9], &fault, &[0; 200]] {
        lines += &format!("0.5 INFO bbz {record:?}\n");
    }
    lines += "bbz [1, 2\nbbz [256]\nbbz \u{1b}[2J[\n";
    let outcome = trace_lines(&folder, &lines, &[]);
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""), "{}", outcome.stderr);
    assert_eq!(outcome.stdout.matches("a record cannot be read, ").count(), 10);
    for part in
        ["does not know its kind", "its length is wrong", "means nothing", "text is damaged"]
    {
        assert!(outcome.stdout.contains(part), "{part}: {}", outcome.stdout);
    }
    assert!(!outcome.stdout.contains('\u{1b}'));
    let plain = trace_lines(&folder, &lines, &["--plain"]);
    assert_eq!((plain.status, plain.stdout.as_str()), (Some(0), ""));
    assert_eq!(plain.stderr.matches("warning: a record cannot be read, ").count(), 10);
}

/// Tests every record cut off at every byte, and with every byte changed.
#[test]
fn any_bytes_in_a_record_are_accepted() {
    let folder = built("trace_broken", "log(nil, 1, 2.5, \"x\", {})\nlog(nil + id)\n");
    let mut lines = String::new();
    for record in robot::records(&folder.read("s.bbi"), 0) {
        for at in 0..record.len() {
            lines += &format!("bbz {:?}\n", &record[..at]);
            for value in [0, 1, 127, 128, 255] {
                let mut changed = record.clone();
                changed[at] = value;
                lines += &format!("bbz {changed:?}\n");
            }
        }
    }
    for arguments in [&["--script", "s.bzz"][..], &["--json", "--script", "s.bzz"], &[]] {
        let outcome = trace_lines(&folder, &lines, arguments);
        assert!(matches!(outcome.status, Some(1 | 3)), "{:?}", outcome.status);
        assert!(!outcome.stderr.contains("panicked"), "{}", outcome.stderr);
    }
}

#[test]
fn json_is_an_object_per_line() {
    let script = "function f(x) { return 1 / x }\nlog(\"a\", 1)\nfunction step() { log(f(0)) }\n";
    let folder = built("trace_json", script);
    let mut lines = String::from("0.25 WARN  low battery\n");
    lines += &log_of(&folder, 1);
    lines += &robot::lines(&[trace::overrun(4, 3).to_vec(), trace::expired(5).to_vec(), vec![99]]);
    let outcome = trace_lines(&folder, &lines, &["--json", "--script", "s.bzz"]);
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(1), ""));
    let objects: Vec<Value> =
        outcome.stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let kinds: Vec<&str> = objects.iter().map(|object| object["kind"].as_str().unwrap()).collect();
    assert_eq!(kinds, ["firmware", "start", "log", "fault", "overrun", "expired", "damaged"]);
    assert_eq!(
        objects[0],
        serde_json::json!({
            "time": 0.25, "kind": "firmware", "level": "WARN", "text": "low battery"
        })
    );
    assert_eq!((&objects[1]["robot_id"], &objects[1]["symbols"]), (&7.into(), &true.into()));
    assert_eq!((&objects[2]["text"], &objects[2]["step"]), (&"a1".into(), &0.into()));
    let fault = &objects[3];
    assert_eq!((&fault["code"], &fault["step"]), (&"R0005".into(), &0.into()));
    assert_eq!(fault["message"], "integer division by zero");
    let place = |call: &Value| {
        format!("{}:{}:{} {}", call["file"], call["line"], call["column"], call["function"])
    };
    let calls: Vec<String> = fault["calls"].as_array().unwrap().iter().map(place).collect();
    assert_eq!(calls, ["\"s.bzz\":1:24 \"f\"", "\"s.bzz\":3:23 \"step\""]);
    assert_eq!((&objects[4]["missed"], &objects[5]["step"]), (&3.into(), &5.into()));
    // Without symbols the same fields are there, empty.
    let outcome = trace_lines(&folder, &log_of(&folder, 1), &["--json"]);
    let fault: Value = serde_json::from_str(outcome.stdout.lines().last().unwrap()).unwrap();
    assert!(fault["calls"][0]["position"].is_u64() && fault["calls"][0]["file"].is_null());
}

#[test]
fn until_fault_ends_there() {
    let folder = built("trace_until", "log(1)\nlog(nil + id)\n");
    let lines = log_of(&folder, 0) + "9.0 INFO later\n";
    let outcome = trace_lines(&folder, &lines, &["--script", "s.bzz"]);
    assert_eq!((outcome.status, outcome.stdout.contains("later")), (Some(1), true));
    let outcome = trace_lines(&folder, &lines, &["--script", "s.bzz", "--until-fault"]);
    assert_eq!((outcome.status, outcome.stdout.contains("later")), (Some(1), false));
}

/// A script with a fault in line 3, and the record of it as a contained one.
fn contained(test: &str) -> (Folder, Vec<u8>) {
    let folder = built(test, "log(1)\nx = nil\nlog(x + 1)\n");
    let mut record = robot::records(&folder.read("s.bbi"), 0).pop().unwrap();
    assert_eq!(record[0], 3, "a fault");
    record[0] = 9;
    (folder, record)
}

/// The script continues: `--until-fault` waits for a fault that stops it.
#[test]
fn a_contained_fault_is_printed_and_the_trace_goes_on() {
    let (folder, record) = contained("trace_contained");
    let lines = robot::lines(&[record]) + "9.0 INFO later\n";
    let outcome = trace_lines(&folder, &lines, &["--script", "s.bzz", "--until-fault"]);
    assert_eq!((outcome.status, outcome.stdout.contains("later")), (Some(1), true));
    outcome.reports(&["error[R0001]", "s.bzz:3:5", "the script goes on"]);
}

#[test]
fn json_of_contained_faults_and_restarts() {
    let (folder, record) = contained("trace_contained_json");
    let records = [record, trace::restart(7, 20).to_vec(), trace::restart(7, 0).to_vec()];
    let outcome = trace_lines(&folder, &robot::lines(&records), &["--json", "--script", "s.bzz"]);
    assert_eq!(outcome.status, Some(1));
    let objects: Vec<Value> =
        outcome.stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!((&objects[0]["kind"], &objects[0]["code"]), (&"contained".into(), &"R0001".into()));
    assert_eq!(objects[0]["calls"][0]["line"], 3);
    let restart = |time: f64, seconds: f64| serde_json::json!({ "time": time, "kind": "restart", "step": 7, "seconds": seconds });
    assert_eq!(objects[1..], [restart(1.0, 2.0), restart(2.0, 0.0)]);
}

#[test]
fn reports_of_kilobots_are_printed_once_each() {
    let folder = Folder::new("trace_reports");
    let fault = Fault {
        code: FaultCode::DivisionByZero,
        position: 12,
        operands: [Type::Int; 2],
        detail: 0,
    };
    let line = |robot, is_contained| {
        let report = FaultReport { robot, script: 5, fault: Some(fault), is_contained };
        let digits: String = report.message().iter().map(|byte| format!("{byte:02x}")).collect();
        format!("ir {digits}\n")
    };
    let lines = [line(1, false), line(2, true)].concat().repeat(3);
    let outcome = trace_lines(&folder, &lines, &[]);
    assert_eq!(outcome.status, Some(1));
    assert_eq!(outcome.stderr.matches("error[R0005]").count(), 2, "{}", outcome.stderr);
    assert_eq!(outcome.stderr.matches("the script goes on").count(), 1, "{}", outcome.stderr);
}

#[test]
fn wrong_command_lines_have_advice() {
    let folder = Folder::with("trace_usage", "s.bzz", "log(1)\n");
    folder.write("robot.elf", "not an ELF file");
    folder.write("bad.sym", "{}");
    let cases: [(&[&str], &[&str]); 9] = [
        (&["trace"], &["FIRMWARE"]),
        (&["trace", "robot.elf"], &["the robot is not named", "--robot NAME"]),
        (&["trace", "robot.elf", "--robot", "kilobot"], &["Kilobot cannot be", "yet"]),
        (&["trace", "none.elf", "--robot", "crazyflie"], &["there is no file `none.elf`"]),
        (&["trace", "-", "--emulate"], &["no firmware to emulate", "(ELF)"]),
        (&["trace", "-", "--seconds", "3"], &["--emulate"]),
        (&["trace", "-", "--plain", "--json"], &["--plain", "--json"]),
        (&["trace", "-", "--script", "none.bzz"], &["there is no file `none.bzz`"]),
        (&["trace", "-", "--script", "bad.sym"], &["`bad.sym` is ", "bbz build"]),
    ];
    for (arguments, parts) in cases {
        folder.bbz(arguments).fails_with(3, parts);
    }
    let emulated = ["trace", "robot.elf", "--robot", "crazyflie", "--emulate"];
    folder
        .bbz(&[&emulated[..], &["--seconds", "x"]].concat())
        .fails_with(3, &["--seconds", "not a number"]);
    folder.bbz(&[&emulated[..], &["--seconds", "-1"]].concat()).fails_with(3, &["-1"]);
    folder.bbz(&emulated).fails_with(3, &["robot.elf"]);
    folder.write("s.bzz", "log(\n");
    folder.bbz(&["trace", "-", "--script", "s.bzz"]).fails_with(2, &["error[E", "s.bzz:1:"]);
}
