//! The tests of the page that repeat others with more lessons and examples.

use crate::Verdict;
use anyhow::{Context, Result};
use bittybuzz_builds::page_tests::page_tests;
use bittybuzz_builds::shell::Invocation;
use std::path::Path;

/// The only item.
const BROWSERS: &str = "browsers";

/// Path prefixes of the files that the tests are about.
pub const MADE_OF: &[&str] = &[
    "Cargo",
    "arena/src/",
    "bbz/page/",
    "bbz/src/",
    "compiler/src/",
    "docs/lessons/",
    "examples/",
    "live/src/",
    "playground/",
    "robots/",
    "tests/page/",
    "vm-core/src/",
];

pub fn items() -> Vec<String> {
    vec![BROWSERS.to_owned()]
}

pub fn run(_: &str) -> Result<Verdict> {
    // The folder of the site, and its zip.
    let printed =
        Invocation::cargo(&["run", "--quiet", "--package", "xtask", "--", "site"]).output(0)?;
    let printed = String::from_utf8(printed.stdout)?;
    let site = printed.lines().rev().nth(1).context("`xtask site` prints a folder and a file")?;
    let tests = page_tests(Path::new(site), "soak")?;
    let output = tests.output_if(|output| output.status.code().is_some())?;
    let printed = String::from_utf8_lossy(&output.stdout).into_owned();
    Ok(match output.status.success() {
        true => Verdict::Shown(printed.lines().last().context("pytest prints a line")?.to_owned()),
        false => Verdict::Missing(printed),
    })
}
