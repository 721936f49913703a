//! Carries out a sweep on each engine that schedules jobs, and compares the tables.

use crate::Verdict;
use anyhow::{Context, Result};
use bittybuzz_builds::setup;
use bittybuzz_builds::shell::Invocation;

/// The engines: two chunks at a time in each.
const ENGINES: [&str; 6] = ["shell", "processes", "dask", "ray", "hyperqueue", "slurm"];

/// Path prefixes of the files that sweeps are about.
pub const MADE_OF: &[&str] = &["Cargo", "bbz/chunks/", "bbz/src/", "python/", "tests/executors/"];

/// Returns the names of the engines.
pub fn items() -> Vec<String> {
    ENGINES.map(str::to_owned).to_vec()
}

/// Carries out a sweep with an engine.
pub fn run(item: &str) -> Result<Verdict> {
    let python = setup::executors()?;
    let command = Invocation::named("python3", &python, &["tests/executors/run.py", item]);
    let output = command.output_if(|output| output.status.code().is_some())?;
    let printed = String::from_utf8_lossy(&output.stdout).into_owned();
    Ok(match output.status.success() {
        true => Verdict::Shown(printed.lines().last().context("it prints a line")?.to_owned()),
        false => Verdict::Missing(printed + &String::from_utf8_lossy(&output.stderr)),
    })
}
