//! The Python module of `python/`: wheel, tests and types.

use anyhow::{Result, ensure};
use bittybuzz_builds::shell::{Invocation, target};
use bittybuzz_builds::{cargo_test, python_module, setup};
use std::collections::BTreeSet;

/// The crates that have other features in the module than in `bbz`. No crate of this repository uses them.
const OTHER_FEATURES: [&str; 1] = ["num-integer"];

/// Builds the wheel of the module, installs it into a Python of its own, and runs its tests, the code of its
/// guide, and the checks of its types there.
pub fn check() -> Result<()> {
    let python = setup::module_tests()?;
    python_module::install(&python, &python_module::tested(&python)?)?;
    check_features()?;
    let run = |arguments: &[&str]| Invocation::named("python3", &python, arguments);
    // The tests compare with a `bbz` of the same profile.
    let bbz = cargo_test::bbz()?.display().to_string();
    run(&["-m", "pytest", "-q", "-p", "no:cacheprovider", "python/tests"])
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .env("BBZ", &bbz)
        .run()?;
    let cache = target()?.join("mypy").display().to_string();
    let settings = ["--strict", "--cache-dir", &cache];
    run(&[&["-m", "mypy"], &settings[..], &["python/tests"]].concat()).run()?;
    let allowed = ["--allowlist", "python/stubtest.txt"];
    run(&[&["-m", "mypy.stubtest"], &allowed[..], &["bittybuzz"]].concat())
        .env("MYPY_CACHE_DIR", &cache)
        .run()
}

/// Fails if `bbz` alone has a crate with other features than the module has it. Users build `bbz` alone, with
/// fewer features of shared crates than tests have, and the wheel shows that it compiles with these.
fn check_features() -> Result<()> {
    let (tool, module) = (features("bbz")?, features(cargo_test::PYTHON)?);
    let is_known = |line: &&String| OTHER_FEATURES.iter().any(|name| line.starts_with(name));
    let other: Vec<&str> =
        tool.difference(&module).filter(|line| !is_known(line)).map(String::as_str).collect();
    ensure!(
        other.is_empty(),
        "the module of Python has these crates of `bbz` with other features, so that its wheel does not show \
         that `cargo build --package bbz` succeeds: {}",
        other.join(", ")
    );
    Ok(())
}

/// Returns a line for each crate in the library of a package: its name, version and features.
fn features(package: &str) -> Result<BTreeSet<String>> {
    let form = ["--edges", "normal,no-proc-macro", "--prefix", "none", "--format", "{p} {f}"];
    let output =
        Invocation::cargo(&[&["tree", "--package", package], &form[..]].concat()).output(0)?;
    let text = String::from_utf8(output.stdout)?;
    // Cargo marks the crates whose dependencies it has listed already.
    Ok(text.lines().map(|line| line.trim_end_matches(" (*)").to_owned()).collect())
}
