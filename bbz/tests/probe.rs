//! `bbz trace` of a robot on a probe with a fake probe-rs: not tried on hardware.
#![cfg(unix)]

use crate::support;
use crate::support::Folder;
use crate::support::probe_rs;
use crate::support::robot;
use std::io::{BufRead, BufReader, Read};
use std::process::Command;

const TRACE: [&str; 6] = ["trace", "robot.elf", "--robot", "crazyflie", "--script", "s.bzz"];

/// A folder with a script that logs or fails, and the output of a robot that runs it.
fn folder(test: &str, script: &str) -> Folder {
    let folder = Folder::with(test, "s.bzz", script);
    folder.write("robot.elf", "for probe-rs only");
    assert_eq!(folder.bbz(&["build", "s.bzz", "--robot", "crazyflie"]).status, Some(0));
    folder.write("log", robot::lines(&robot::records(&folder.read("s.bbi"), 2)));
    folder
}

#[test]
fn messages_of_probe_rs_are_printed() {
    let folder = folder("probe_prints", "function step() { log(\"x\") }\n");
    probe_rs::install(&folder, "echo 'Warning: slow' >&2; cat log");
    let outcome = probe_rs::bbz(&folder, &TRACE);
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), "Warning: slow\n"));
    assert!(outcome.stdout.contains("start     robot 7 runs script "), "{}", outcome.stdout);
    assert!(outcome.stdout.ends_with("1.000000 step 0    x\n    2.000000 step 1    x\n"));
    assert_eq!(
        probe_rs::calls(&folder),
        ["attach --non-interactive --chip STM32F405RG --no-catch-hardfault --no-catch-reset \
          --rtt-channel-mode no-block-skip --log-format {t} {L} {s} robot.elf"]
    );
}

#[test]
fn ctrl_c_detaches_from_the_robot() {
    let folder = folder("probe_interrupt", "function step() { log(\"x\") }\n");
    let script = "trap 'echo let go >&2; exit 0' INT\ncat log\nwhile :; do sleep 0.01; done";
    probe_rs::install(&folder, script);
    let mut child = probe_rs::command(&folder, &TRACE).spawn().unwrap();
    let mut stdout = BufReader::new(child.stdout.take().unwrap());
    let mut before = String::new();
    while !before.contains("step 1") {
        assert_ne!(stdout.read_line(&mut before).unwrap(), 0, "only printed:\n{before}");
    }
    let killed = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(killed.success());
    let mut outcome = support::finish(child);
    stdout.read_to_string(&mut outcome.stdout).unwrap();
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), "let go\n"));
}

#[test]
fn until_fault_detaches_from_the_robot() {
    let folder = folder("probe_fault", "log(nil + id)\n");
    let script = "trap 'echo let go >&2; exit 0' INT\ncat log\nwhile :; do sleep 0.01; done";
    probe_rs::install(&folder, script);
    let outcome = probe_rs::bbz(&folder, &[&TRACE[..], &["--until-fault"]].concat());
    assert_eq!(outcome.status, Some(1));
    outcome.reports(&["error[R0001]", "s.bzz:1:5", "let go"]);
}

#[test]
fn failures_of_probe_rs_have_advice() {
    let folder = folder("probe_fails", "log(1)\n");
    let missing = folder.command(&TRACE).env("PATH", folder.path("")).spawn().unwrap();
    support::finish(missing).fails_with(3, &["probe-rs is not installed", "cargo install"]);
    probe_rs::install(&folder, "echo 'Error: No connected probes were found.' >&2; exit 1");
    probe_rs::bbz(&folder, &TRACE).fails_with(3, &["no debug probe is connected", "udev"]);
    probe_rs::install(&folder, "exit 7");
    probe_rs::bbz(&folder, &TRACE).fails_with(3, &["probe-rs has failed", "7"]);
}
