//! `bbz run` in real time, and Ctrl-C.
#![cfg(unix)]

use crate::support;
use crate::support::{Folder, Outcome};
use std::io::{BufRead, BufReader, Read};
use std::process::{Child, Command};

/// Starts a run, reads its output up to `line` and then presses Ctrl-C. The outcome has the output
/// after that line.
fn interrupt_after(test: &str, script: &str, arguments: &[&str], line: &str) -> Outcome {
    let folder = Folder::with(test, "s.bzz", script);
    let mut child = folder.command(&[&["run", "s.bzz"], arguments].concat()).spawn().unwrap();
    let mut stdout = BufReader::new(child.stdout.take().unwrap());
    let mut before = String::new();
    while !before.ends_with(line) {
        assert_ne!(stdout.read_line(&mut before).unwrap(), 0, "only printed:\n{before}");
    }
    press(&child);
    let mut outcome = support::finish(child);
    stdout.read_to_string(&mut outcome.stdout).unwrap();
    outcome
}

/// Sends Ctrl-C as the terminal does.
fn press(child: &Child) {
    let status = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(status.success());
}

#[test]
fn steps_go_on_until_ctrl_c_and_then_destroy_is_called() {
    let script = "n = 0\nfunction step() { n = n + 1  log(\"step \", n) }\nfunction destroy() { log(\"destroy\") }\n";
    let outcome = interrupt_after("ticking", script, &[], "step 3\n");
    assert_eq!(outcome.status, Some(0));
    assert!(outcome.stdout.ends_with("destroy\n"), "{}", outcome.stdout);
    assert_eq!(outcome.stdout.matches("destroy").count(), 1);
    assert_eq!(outcome.stderr, "");
}

#[test]
fn a_fault_in_destroy_is_a_fault() {
    let script = "function step() { log(1) }\nfunction destroy() { log(nil + step) }\n";
    let outcome = interrupt_after("destroy_fault", script, &[], "1\n");
    assert_eq!(outcome.status, Some(1));
    outcome.reports(&["R0001", "s.bzz:2:"]);
}

#[test]
fn destroy_cannot_keep_the_run_alive() {
    let script = "function step() { log(1) }\nfunction destroy() { while(1) delay(10) }\n";
    let outcome = interrupt_after("destroy_endless", script, &[], "1\n");
    assert_eq!(outcome.status, Some(0));
    outcome.reports(&["stopped by Ctrl-C", "s.bzz:2:"]);
}

#[test]
fn an_interrupted_script_reports_its_place() {
    for (test, script, line) in [
        ("endless_global", "log(\"on\")\nwhile(1) { }\n", "s.bzz:2:"),
        ("endless_delay", "log(\"on\")\ndelay(3600000)\n", "s.bzz:2:1"),
        ("endless_step", "function step() {\n log(\"on\")\n while(1) { }\n}\n", "s.bzz:3:"),
    ] {
        let outcome = interrupt_after(test, script, &[], "on\n");
        assert_eq!((outcome.status, outcome.stdout.as_str()), (Some(0), ""), "{test}");
        outcome.reports(&["stopped by Ctrl-C", line]);
    }
}

#[test]
fn full_speed_can_be_stopped() {
    let script = "log(\"on\")\nfunction step() { x = 1 }\n";
    let outcome = interrupt_after("full_speed", script, &["--steps", "1000000000000"], "on\n");
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
}

#[test]
fn a_delay_takes_its_time() {
    let folder = Folder::with("real_time", "s.bzz", "log(1)\ndelay(300)\nlog(2)\n");
    let start = std::time::Instant::now();
    folder.bbz(&["run", "s.bzz"]).succeeds_with("1\n2\n");
    // The delay is never shorter; its exact length depends on the load of the computer.
    assert!(start.elapsed().as_millis() >= 300);
}

#[test]
fn a_script_without_step_ends() {
    for (test, script) in [
        ("no_step", "function init() { log(1) }\n"),
        ("step_nil", "log(1)\nfunction first() { }\nstep = first\nstep = nil\n"),
        ("step_removed", "function step() { log(1)  step = nil }\n"),
    ] {
        let outcome = Folder::with(test, "s.bzz", script).bbz(&["run", "s.bzz"]);
        assert_eq!((outcome.status, outcome.stdout.as_str()), (Some(0), "1\n"), "{test}");
    }
}

#[test]
fn a_closed_output_ends_the_run() {
    let script = "function step() { log(\"line\") }\n";
    let folder = Folder::with("closed_pipe", "s.bzz", script);
    let mut child = folder.command(&["run", "s.bzz"]).spawn().unwrap();
    drop(child.stdout.take());
    let outcome = support::finish(child);
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
}
