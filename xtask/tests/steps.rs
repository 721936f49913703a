//! The lists that have to agree with the steps of `cargo xtask ci`, outside of the program.

#![allow(clippy::unwrap_used, reason = "a failure here fails the test")]

use std::path::Path;
use std::process::Command;

/// Reads a file of the repository.
fn read(path: &str) -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    std::fs::read_to_string(root.join(path)).unwrap_or_else(|error| panic!("{path}: {error}"))
}

#[test]
fn the_workflow_has_a_job_for_each_step() {
    let text = read(".github/workflows/ci.yml");
    let (_, list) = text.split_once("\n        step:\n").unwrap();
    let jobs = list.lines().map_while(|line| line.trim_start().strip_prefix("- "));
    let help = Command::new(env!("CARGO_BIN_EXE_xtask")).args(["ci", "--help"]).output().unwrap();
    let help = String::from_utf8(help.stdout).unwrap();
    let steps = help.lines().filter_map(|line| line.trim_start().strip_prefix("- "));
    let steps: Vec<_> = steps.filter_map(|line| Some(line.split_once(':')?.0)).collect();
    assert!(steps.contains(&"lint"), "{help}");
    assert_eq!(jobs.collect::<Vec<_>>(), steps);
}
