//! The tool in a process of another program, as a module of an interpreter carries it.
#![cfg(unix)]

use std::env;
use std::io::{BufRead, BufReader, Read};
use std::os::unix::process::CommandExt;
use std::process::{self, Command, Stdio};
use std::sync::Arc;

use bbz_tool::Launch;
use signal_hook::consts::SIGINT;

use crate::emulated;
use crate::support::{Folder, Outcome, finish};

/// The test that is the other program if it finds [`ARGUMENTS`], and what it passes to the tool.
const CARRIER: &str = "launch::usage_lines_begin_with_the_words_that_start_the_tool";
/// The variable with the arguments of the tool, a line for each.
const ARGUMENTS: &str = "BBZ_TEST_ARGUMENTS";
/// The variable that is set if the process calls the tool twice.
const TWICE: &str = "BBZ_TEST_TWICE";

/// Returns the command that starts the other program in the folder, which calls the tool.
fn command(folder: &Folder, arguments: &[&str]) -> Command {
    let mut command = Command::new(env::current_exe().unwrap());
    command
        // The first word of the process is not the name of any file.
        .arg0("interpreter")
        .args(["--exact", CARRIER, "--nocapture", "--quiet"])
        .env(ARGUMENTS, arguments.join("\n"))
        .current_dir(folder.path("."))
        .env_remove("BUZZ_INCLUDE_PATH")
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}

fn run(folder: &Folder, arguments: &[&str]) -> Outcome {
    finish(command(folder, arguments).spawn().unwrap())
}

/// The other program: it has a handler for Ctrl-C, and threads with less stack than the tool needs.
fn carry(arguments: &str) -> ! {
    signal_hook::flag::register(SIGINT, Arc::default()).unwrap();
    let launch = Launch {
        program: ["/opt/bin/python3", "-m", "bittybuzz"].map(Into::into).to_vec(),
        arguments: arguments.lines().map(Into::into).collect(),
        emulators: Some(env::current_dir().unwrap().join("programs")),
    };
    let mut status = bbz_tool::main(launch.clone());
    if env::var_os(TWICE).is_some() {
        status = bbz_tool::main(launch);
    }
    process::exit(status.into());
}

#[test]
fn usage_lines_begin_with_the_words_that_start_the_tool() {
    if let Ok(arguments) = env::var(ARGUMENTS) {
        carry(&arguments);
    }
    let folder = Folder::new("launch_usage");
    let help = run(&folder, &["sim", "--help"]);
    assert_eq!((help.status, help.stderr.as_str()), (Some(0), ""));
    let usage = "\nUsage: python3 -m bittybuzz sim [OPTIONS] <SCENARIO>\n";
    assert!(help.stdout.contains(usage), "{}", help.stdout);
    let version = run(&folder, &["--version"]);
    let line = format!("bbz {}\n", env!("CARGO_PKG_VERSION"));
    assert!(version.stdout.ends_with(&line), "{}", version.stdout);
    let wrong = run(&folder, &["simulate"]);
    assert_eq!(wrong.status, Some(3));
    wrong.reports(&["'simulate'", "Usage: python3 -m bittybuzz <COMMAND>"]);
}

#[test]
fn the_status_is_that_of_the_program() {
    for (script, status) in [("log(1)\n", 0), ("x = nil + log\n", 1), ("x = \n", 2)] {
        let folder = Folder::with("launch_status", "s.bzz", script);
        let carried = run(&folder, &["run", "s.bzz"]);
        assert_eq!(carried.status, Some(status), "{}", carried.stderr);
        assert_eq!(carried.stderr, folder.bbz(&["run", "s.bzz"]).stderr);
    }
}

/// Threads of other programs have 2 MiB by default, and may have less.
#[test]
fn the_tool_has_a_stack_of_its_own() {
    let folder = Folder::with("launch_stack", "s.bzz", &deep());
    let carried = command(&folder, &["check", "s.bzz"]).env("RUST_MIN_STACK", "262144").spawn();
    let (carried, own) = (finish(carried.unwrap()), folder.bbz(&["check", "s.bzz"]));
    assert_eq!((carried.status, carried.stderr), (own.status, own.stderr));
}

/// Returns a script with expressions as deep as the compiler reads them.
fn deep() -> String {
    format!("x = {}1{}\n", "(".repeat(190), ")".repeat(190))
}

#[test]
fn ctrl_c_is_taken_over_from_the_handler_of_the_other_program() {
    let script = "function step() { log(\"on\") }\nfunction destroy() { log(\"destroy\") }\n";
    let folder = Folder::with("launch_interrupt", "s.bzz", script);
    let mut child = command(&folder, &["run", "s.bzz"]).spawn().unwrap();
    let mut stdout = BufReader::new(child.stdout.take().unwrap());
    let mut before = String::new();
    while !before.ends_with("on\n") {
        assert_ne!(stdout.read_line(&mut before).unwrap(), 0, "only printed:\n{before}");
    }
    assert!(
        Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success()
    );
    let outcome = finish(child);
    let mut after = String::new();
    stdout.read_to_string(&mut after).unwrap();
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
    assert!(after.ends_with("destroy\n"), "{after}");
}

#[test]
fn emulators_are_searched_in_the_folder_of_the_launch() {
    let folder = emulated::folder("launch_emulator", "log(1)\n");
    std::fs::create_dir(folder.path("programs")).unwrap();
    let program = format!("programs/bbz-emulate-stm32{}", env::consts::EXE_SUFFIX);
    std::fs::rename(folder.path("emulator"), folder.path(&program)).unwrap();
    let trace = ["trace", "robot.elf", "--robot", "crazyflie", "--emulate", "--seconds", "0.05"];
    let outcome = run(&folder, &trace);
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    assert!(!folder.read("commands").is_empty());
}

#[test]
fn a_second_command_in_a_process_is_refused() {
    let folder = Folder::with("launch_twice", "s.bzz", "log(1)\n");
    let outcome = finish(command(&folder, &["run", "s.bzz"]).env(TWICE, "1").spawn().unwrap());
    assert_eq!(outcome.status, Some(3));
    assert_eq!(outcome.stdout.matches("1\n").count(), 1, "{}", outcome.stdout);
    outcome.reports(&["this process has run a command of bbz before", "start another process"]);
}
