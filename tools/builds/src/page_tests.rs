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

/// Returns the command that tests `bbz` and the playground in the folder `site`. `marked` is an expression of
/// pytest: the test has marks for which it is true.
pub fn page_tests(site: &Path, marked: &str) -> Result<Invocation> {
    let python = setup::browser()?;
    let bbz = cargo_test::bbz()?;
    let arguments = [&OPTIONS[..], &["-m", marked, FOLDER]].concat();
    Ok(Invocation::named("python3", &python, &arguments)
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .env("BBZ", &bbz.display().to_string())
        .env("SITE", &site.display().to_string()))
}
