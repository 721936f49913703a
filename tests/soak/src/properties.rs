//! Properties of compiler, messages and traces, with many more random cases than CI has, and others each time.

use crate::Verdict;
use anyhow::Result;
use bittybuzz_builds::shell::Invocation;

/// Packages whose tests state properties, and how many cases of each are tried.
const PACKAGES: [(&str, u32); 4] = [
    ("bittybuzz-arena", 10_000),
    ("bittybuzz-comms", 20_000),
    ("bittybuzz-compiler", 20_000),
    ("bittybuzz-vm-core", 100_000),
];

/// Names of the packages.
pub fn items() -> Vec<String> {
    PACKAGES.iter().map(|(package, _)| (*package).to_owned()).collect()
}

/// Tests a package.
pub fn run(item: &str) -> Result<Verdict> {
    let Some((package, cases)) = PACKAGES.iter().find(|(package, _)| *package == item) else {
        return Ok(Verdict::Missing("no such package".to_owned()));
    };
    let cases = cases.to_string();
    Invocation::cargo(&["test", "--package", package]).env("PROPTEST_CASES", &cases).run()?;
    Ok(Verdict::Shown(format!("{cases} cases of each property")))
}
