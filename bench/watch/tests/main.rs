//! The program by its command line.

#![allow(clippy::unwrap_used, reason = "a failure here fails the test")]

use std::process::{Command, Output};

fn run(words: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_bittybuzz-bench-watch")).args(words).output().unwrap()
}

/// The program ends with an error if the observer changed the run.
#[test]
fn an_observer_does_not_change_a_run() {
    let output = run(&["20", "5"]);
    assert!(output.status.success(), "{output:?}");
}

#[test]
fn a_wrong_command_line_is_an_error() {
    for words in [&[][..], &["20"], &["twenty", "5"], &["0", "1"]] {
        let output = run(words);
        assert!(!output.status.success() && !output.stderr.is_empty(), "{words:?}: {output:?}");
    }
}
