//! The tests of the page of `bbz sim --view` and of the playground, which a browser shows.

use crate::cargo_test;
use crate::setup;
use crate::shell::Invocation;
use anyhow::Result;
use std::path::Path;

/// The options of pytest. Each file is tested in one of two processes, which wait for pages and runs for half of
/// their time.
const OPTIONS: [&str; 9] =
    ["-m", "pytest", "-q", "-p", "no:cacheprovider", "-n", "2", "--dist", "loadfile"];

/// The folder of the tests, from the root.
const FOLDER: &str = "tests/page";

/// The tests of the page that run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PageTests {
    /// Some of each kind
    Sample,
    /// All but those that repeat others with more examples
    Usual,
    /// All
    All,
}

/// Returns the command that tests `bbz` and the playground in the folder `site`.
pub fn page_tests(site: &Path, tests: PageTests) -> Result<Invocation> {
    let python = setup::browser()?;
    let bbz = cargo_test::bbz()?;
    let marked: &[&str] = match tests {
        PageTests::Sample => &["-m", "sample and not soak"],
        PageTests::Usual => &["-m", "not soak"],
        PageTests::All => &[],
    };
    let arguments = [&OPTIONS[..], marked, &[FOLDER]].concat();
    Ok(Invocation::named("python3", &python, &arguments)
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .env("BBZ", &bbz.display().to_string())
        .env("SITE", &site.display().to_string()))
}
