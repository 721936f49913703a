//! The Python module of `python/`: wheel, tests and types.

use anyhow::{Result, ensure};
use bittybuzz_builds::cargo_test::{self, shared_packages};
use bittybuzz_builds::python_module::{self, TESTED};
use bittybuzz_builds::setup;
use bittybuzz_builds::shell::{Invocation, target};
use std::collections::BTreeSet;

/// Builds the wheel of the module, installs it into a Python of its own, and runs its tests, the code of its
/// guide, and the checks of its types there.
pub fn check() -> Result<()> {
    let python = setup::module_tests()?;
    check_features()?;
    python_module::install(&python, &python_module::tested(&python)?)?;
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

/// Fails if a crate of the module has other features than in the build of all tests: cargo would compile
/// it twice, and every crate that uses it.
fn check_features() -> Result<()> {
    let module = ["--package", cargo_test::PYTHON];
    let module = features(&[&module[..], &TESTED, &["--edges", "normal,build"]].concat())?;
    let tests = features(&[&shared_packages()[..], &["--edges", "normal,build,dev"]].concat())?;
    let other = others(&module, &tests);
    ensure!(
        other.is_empty(),
        "the Python module has these crates with other features than tests, so that both compile them; add \
         the missing features to bbz/features/Cargo.toml: {}",
        other.join(", ")
    );
    Ok(())
}

/// Returns the lines of `module` that `tests` have only with other features, and those of `tests`.
fn others(module: &BTreeSet<String>, tests: &BTreeSet<String>) -> Vec<String> {
    let crate_of = |line: &str| line.split(' ').take(2).collect::<Vec<_>>().join(" ");
    let mut other = Vec::new();
    for line in module.difference(tests) {
        let known = tests.iter().filter(|known| crate_of(known) == crate_of(line));
        let known: Vec<&str> = known.map(String::as_str).collect();
        if !known.is_empty() {
            other.push(format!("{line} (in tests: {})", known.join("; ")));
        }
    }
    other
}

/// Returns a line for each crate that cargo builds with these options: its name, version and features.
fn features(options: &[&str]) -> Result<BTreeSet<String>> {
    let form = ["--prefix", "none", "--format", "{p} {f}"];
    let output = Invocation::cargo(&[&["tree"], options, &form[..]].concat()).output(0)?;
    let text = String::from_utf8(output.stdout)?;
    // Cargo marks the crates whose dependencies it has listed already.
    Ok(text.lines().map(|line| line.trim_end_matches(" (*)").to_owned()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(text: &str) -> BTreeSet<String> {
        text.lines().map(str::to_owned).collect()
    }

    #[test]
    fn crates_with_other_features_are_found_and_additional_crates_are_not() {
        let tests = lines("syn v2.0.1 full\nsyn v3.0.0 full,visit\nserde v1.0.0 ");
        assert!(others(&lines("syn v2.0.1 full\npyo3 v0.30.0 abi3"), &tests).is_empty());
        let module = lines("syn v3.0.0 full\nserde v1.0.0 rc\npyo3 v0.30.0 abi3");
        assert_eq!(
            others(&module, &tests),
            [
                "serde v1.0.0 rc (in tests: serde v1.0.0 )",
                "syn v3.0.0 full (in tests: syn v3.0.0 full,visit)"
            ]
        );
    }
}
