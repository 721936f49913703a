//! `bbz trace --emulate` with a fake emulator: the commands that it receives, and the output for
//! its events. The real emulators with the real firmware are tested in `tests/`.
#![cfg(unix)]

use crate::support;
use crate::support::elf;
use crate::support::robot;
use std::fs;
use std::io::{BufRead, BufReader};
use std::os::unix::process::CommandExt;
use std::process::Command;
use std::time::Duration;

use crate::support::{Folder, Outcome};
use bittybuzz_emulation::message::{EmulatorEvent, TimedEvent};
use serde_json::{Value, json};

/// Records every command; the first run returns the events of the file.
const EMULATOR: &str = r#"#!/bin/sh
while read -r line; do
  echo "$line" >> commands
  case "$line" in
    *'"run"'*)
      cat events; : > events
      until=$(echo "$line" | sed 's/.*"until_ns":\([0-9]*\).*/\1/')
      echo "{\"reply\":\"paused\",\"at_ns\":$until,\"reason\":\"time\",\"silent_until_ns\":$until}" ;;
    *'"load"'*) cat loaded ;;
    *) echo '{"reply":"ok"}' ;;
  esac
done
"#;

/// Messages of the firmware in the tests, with their numbers.
const MESSAGES: [(u16, &str, &str); 3] =
    [(1, "defmt_info", "bbz {=[u8]}"), (2, "defmt_warn", "low battery"), (3, "defmt_info", "boot")];

/// Returns a folder with a script, an image, and a fake emulator.
pub fn folder(test: &str, script: &str) -> Folder {
    let folder = Folder::with(test, "s.bzz", script);
    folder.write("robot.elf", elf::with_messages("raw", &MESSAGES));
    folder.program("emulator", EMULATOR.as_bytes());
    folder.write("loaded", "{\"reply\":\"ok\"}\n");
    folder.write("events", "");
    assert_eq!(folder.bbz(&["build", "s.bzz", "--robot", "crazyflie"]).status, Some(0));
    folder
}

fn emulate(folder: &Folder, arguments: &[&str]) -> Outcome {
    let trace = ["trace", "robot.elf", "--robot", "crazyflie", "--emulate"];
    let emulator = folder.path("emulator");
    let program = ["--emulator", emulator.to_str().unwrap(), "--seconds", "0.05"];
    folder.bbz(&[&trace[..], &program, arguments].concat())
}

/// Writes events at intervals of one millisecond.
fn write_events(folder: &Folder, events: Vec<EmulatorEvent>) {
    let mut text = String::new();
    for (number, event) in events.into_iter().enumerate() {
        let at = Duration::from_millis(u64::try_from(number).unwrap());
        text += &serde_json::to_string(&TimedEvent { at, event }).unwrap();
        text.push('\n');
    }
    folder.write("events", text);
}

/// A message as firmware sends it without compression: its number, and a slice as length and bytes.
fn message(number: u16, slice: Option<&[u8]>) -> Vec<u8> {
    let mut bytes = number.to_le_bytes().to_vec();
    if let Some(slice) = slice {
        bytes.extend(u32::try_from(slice.len()).unwrap().to_le_bytes());
        bytes.extend(slice);
    }
    bytes
}

fn log_of(folder: &Folder, steps: u32) -> Vec<u8> {
    let records = robot::records(&folder.read("s.bbi"), steps);
    records.iter().flat_map(|record| message(1, Some(record))).collect()
}

fn commands(folder: &Folder) -> Vec<Value> {
    let text = String::from_utf8(folder.read("commands")).unwrap();
    text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

#[test]
fn the_script_is_written_and_the_time_runs() {
    let folder = folder("emulated_commands", "log(1)\n");
    emulate(&folder, &["--script", "s.bzz"]).succeeds_with("");
    let image = folder.read("s.bbi");
    let length = u32::try_from(image.len()).unwrap().to_le_bytes();
    let section: String =
        [&length[..], &image].concat().iter().map(|byte| format!("{byte:02x}")).collect();
    let commands = commands(&folder);
    assert_eq!(commands[0], json!({ "command": "load", "elf": "robot.elf" }));
    assert_eq!(
        (&commands[1]["command"], &commands[1]["address"]),
        (&json!("write"), &json!(0x0808_0000))
    );
    // The command writes a place of the log of scripts, with the image at its beginning.
    let written = commands[1]["bytes"].as_str().unwrap();
    assert!(written.starts_with(&section) && written.len() == 2 * 4096, "{written}");
    assert!(commands[2..].iter().all(|command| command["command"] == "run"));
    assert_eq!(commands.last().unwrap()["until_ns"], 50_000_000);
    // Without a script the firmware keeps its own.
    fs::remove_file(folder.path("commands")).unwrap();
    emulate(&folder, &[]).succeeds_with("");
    assert!(self::commands(&folder).iter().all(|command| command["command"] != "write"));
}

#[test]
fn messages_of_the_firmware_are_decoded() {
    let folder = folder("emulated_decoded", "function step() { log(\"x\") }\n");
    let bytes = [message(3, None), log_of(&folder, 2), message(2, None)].concat();
    // RTT is read in pieces that do not follow the boundaries of messages.
    let pieces = bytes.chunks(7).map(|piece| EmulatorEvent::Rtt { bytes: piece.to_vec() });
    write_events(&folder, pieces.collect());
    let outcome = emulate(&folder, &["--script", "s.bzz"]);
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
    let lines: Vec<&str> = outcome.stdout.lines().map(|line| &line[13..]).collect();
    assert_eq!((lines[0], lines[4]), ("INFO      boot", "WARN      low battery"));
    assert!(lines[1].starts_with("start     robot 7 runs script "), "{lines:?}");
    assert_eq!(lines[2..4], ["step 0    x", "step 1    x"]);
    assert!(outcome.stdout.starts_with("    0.000000 INFO"), "{}", outcome.stdout);
    // With `--plain` the output is the same as that of `bbz run`.
    write_events(&folder, vec![EmulatorEvent::Rtt { bytes }]);
    let run = folder.bbz(&["run", "s.bzz", "--robot", "crazyflie", "--steps", "2"]);
    emulate(&folder, &["--plain", "--script", "s.bzz"]).succeeds_with(&run.stdout);
}

#[test]
fn leds_are_printed_on_request() {
    let folder = folder("emulated_leds", "log(1)\n");
    let events = || {
        vec![
            EmulatorEvent::Led { name: "red".to_owned(), on: true },
            EmulatorEvent::Led { name: "red".to_owned(), on: false },
        ]
    };
    write_events(&folder, events());
    emulate(&folder, &["--outputs"]).succeeds_with(
        "    0.000000 output    led red on\n    \
             0.001000 output    led red off\n",
    );
    write_events(&folder, events());
    emulate(&folder, &[]).succeeds_with("");
}

#[test]
fn motors_are_printed_on_request() {
    let folder = folder("emulated_motors", "log(1)\n");
    let event = || EmulatorEvent::Motor { number: 2, duty: 0.25, frequency_hz: 328_125.0 };
    write_events(&folder, vec![event()]);
    emulate(&folder, &["--outputs"])
        .succeeds_with("    0.000000 output    motor 2 25.0 % at 328.1 kHz\n");
    write_events(&folder, vec![event()]);
    let outcome = emulate(&folder, &["--outputs", "--json"]);
    let object: Value = serde_json::from_str(&outcome.stdout).unwrap();
    assert_eq!(
        object,
        json!({
            "time": 0.0, "kind": "output", "name": "motor 2", "state": "25.0 % at 328.1 kHz"
        })
    );
}

#[test]
fn a_fault_ends_with_status_1() {
    let folder = folder("emulated_fault", "function step() {\n  log(1 / (id - id))\n}\n");
    let bytes = [log_of(&folder, 1), message(2, None)].concat();
    for (arguments, more) in [(&[][..], true), (&["--until-fault"], false)] {
        write_events(&folder, vec![EmulatorEvent::Rtt { bytes: bytes.clone() }]);
        let outcome = emulate(&folder, &[&["--script", "s.bzz"], arguments].concat());
        assert_eq!((outcome.status, outcome.stdout.contains("low battery")), (Some(1), more));
        outcome.reports(&["error[R0005]", "s.bzz:2:7", "after 0 complete steps, at 0.000000 s"]);
    }
}

#[test]
fn failures_of_the_firmware_are_failures() {
    let folder = folder("emulated_failures", "log(1)\n");
    let cases = [
        (EmulatorEvent::HardwareError { text: "too fast".to_owned() }, "error: too fast"),
        (EmulatorEvent::Lockup { pc: 0x0800_4123 }, "error: the core is locked up at 0x08004123"),
    ];
    for (event, message) in cases {
        write_events(&folder, vec![event]);
        emulate(&folder, &[]).fails_with(1, &[message]);
    }
    write_events(&folder, vec![EmulatorEvent::Reset { cause: "independent_watchdog".to_owned() }]);
    emulate(&folder, &[])
        .succeeds_with("    0.000000 reset     the chip was reset: independent_watchdog\n");
}

#[test]
fn without_seconds_it_goes_on_until_ctrl_c() {
    // The signal goes to this process, as a program would send it, and to the whole group, as a
    // terminal does.
    for (test, group) in [("emulated_interrupt", ""), ("emulated_interrupt_group", "-")] {
        let folder = folder(test, "function step() { log(\"x\") }\n");
        write_events(&folder, vec![EmulatorEvent::Rtt { bytes: log_of(&folder, 2) }]);
        let emulator = folder.path("emulator");
        let mut child = folder
            .command(&["trace", "robot.elf", "--robot", "crazyflie", "--emulate", "--emulator"])
            .args([emulator.to_str().unwrap(), "--script", "s.bzz"])
            .process_group(0)
            .spawn()
            .unwrap();
        let mut stdout = BufReader::new(child.stdout.take().unwrap());
        let mut before = String::new();
        while !before.contains("step 1") {
            assert_ne!(stdout.read_line(&mut before).unwrap(), 0, "only printed:\n{before}");
        }
        let whom = format!("{group}{}", child.id());
        assert!(Command::new("kill").args(["-INT", "--", &whom]).status().unwrap().success());
        support::finish(child).succeeds_with("");
    }
}

#[test]
fn the_emulator_is_found_beside_bbz_and_in_path() {
    let folder = folder("emulated_found", "log(1)\n");
    write_events(&folder, vec![EmulatorEvent::Rtt { bytes: message(3, None) }]);
    let trace = ["trace", "robot.elf", "--robot", "crazyflie", "--emulate", "--seconds", "0.01"];
    let others = std::env::var_os("PATH").unwrap();
    let path = [folder.path("")].into_iter().chain(std::env::split_paths(&others));
    let in_path = folder
        .command(&[&trace[..], &["--emulator", "emulator"]].concat())
        .env("PATH", std::env::join_paths(path).unwrap())
        .spawn();
    support::finish(in_path.unwrap()).succeeds_with("    0.000000 INFO      boot\n");
    // A copy of bbz only has the programs next to it that the test puts there.
    folder.program("bbz", &fs::read(env!("CARGO_BIN_EXE_bbz")).unwrap());
    let alone = || {
        let mut command = Command::new(folder.path("bbz"));
        command.args(trace).current_dir(folder.path(""));
        command.output().unwrap()
    };
    let missing = alone();
    assert_eq!(missing.status.code(), Some(3));
    assert!(String::from_utf8(missing.stderr).unwrap().contains("bbz-emulate-stm32"));
    fs::rename(folder.path("emulator"), folder.path("bbz-emulate-stm32")).unwrap();
    assert_eq!(alone().status.code(), Some(0));
}

#[test]
fn failures_of_the_emulator_have_messages() {
    let folder = folder("emulated_wrong", "log(1)\n");
    folder.write("loaded", "{\"reply\":\"error\",\"message\":\"no ARM image\"}\n");
    emulate(&folder, &[]).fails_with(3, &["no ARM image"]);
    folder.write("loaded", "nonsense\n");
    emulate(&folder, &[]).fails_with(3, &["nonsense"]);
    folder.program("emulator", b"#!/bin/sh\n");
    emulate(&folder, &[]).fails_with(3, &["emulator"]);
    fs::remove_file(folder.path("s.bbi")).unwrap();
    emulate(&folder, &["--script", "s.sym"]).fails_with(3, &["`s.sym` describes a script", ".bbi"]);
    fs::remove_file(folder.path("emulator")).unwrap();
    emulate(&folder, &[]).fails_with(3, &["cannot start", "emulator"]);
    folder.write("robot.elf", elf::arm(&[]));
    emulate(&folder, &[]).fails_with(3, &["`robot.elf` has no defmt messages", "cargo built"]);
    folder.write("robot.elf", "text");
    emulate(&folder, &[]).fails_with(3, &["robot.elf"]);
}
