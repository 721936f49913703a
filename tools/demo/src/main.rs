//! `cargo xtask`: runs the demonstration at once, and starts the program `xtask` for all other chores.
//!
//! That program uses the compiler, the emulators' protocol and the long tests. A new user, who sees the
//! demonstration first, does not wait until they are compiled.

use anyhow::{Context, Result};
use bittybuzz_shell::cargo_test::xtask;
use std::env;
use std::ffi::OsString;
use std::process::{Command, ExitCode, ExitStatus};

fn main() -> ExitCode {
    let words: Vec<OsString> = env::args_os().skip(1).collect();
    let plain: Vec<&str> = words.iter().map(|word| word.to_str().unwrap_or_default()).collect();
    let result = match plain[..] {
        ["demo"] => bittybuzz_demo::run(false).map(|()| ExitCode::SUCCESS),
        ["demo", "--no-browser"] => bittybuzz_demo::run(true).map(|()| ExitCode::SUCCESS),
        _ => chore(&words).map(exit_code),
    };
    result.unwrap_or_else(|error| {
        eprintln!("xtask {}: {error:#}", plain.first().unwrap_or(&""));
        ExitCode::FAILURE
    })
}

/// Runs another chore, in the folder of the user.
fn chore(words: &[OsString]) -> Result<ExitStatus> {
    Command::new(xtask()?).args(words).status().context("cannot start xtask")
}

/// Returns the status of a chore, or 1 if a signal ended it.
fn exit_code(status: ExitStatus) -> ExitCode {
    status.code().and_then(|code| u8::try_from(code).ok()).map_or(ExitCode::FAILURE, ExitCode::from)
}
