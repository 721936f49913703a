//! `cargo test` with the settings of all chores.

use crate::{Invocation, target};
use anyhow::Result;
use std::env::consts::EXE_SUFFIX;
use std::path::PathBuf;

/// Arguments that skip tests which take long and seldom fail alone: those on the slower emulated processor.
pub const SKIP_SLOW: [&str; 2] = ["--skip", "qemu"];

/// The package whose integration test carries out the guides. It compiles a copy of the repository,
/// so it is a step of its own.
pub const GUIDES: &str = "bittybuzz-guides";

/// The variable that makes tests of `tests/hil` compare their figures with `bench/hil.json` if it is
/// [`CHECK`], and record them if it is a date.
pub const FIGURES: &str = "BITTYBUZZ_FIGURES";

/// The value of [`FIGURES`] that compares.
pub const CHECK: &str = "check";

/// Returns `cargo test` with these arguments. Property tests use the same cases each time, so that
/// a failure comes from the change under test; `cargo xtask soak properties` tries other cases.
pub fn cargo_test(arguments: &[&str]) -> Invocation {
    Invocation::cargo(&[&["test"], arguments].concat()).env("PROPTEST_RNG_SEED", "1")
}

/// Returns the tests of the guides. `wanted` is `changed` for those whose files have changed since
/// their recorded run, or the date under which their runs are recorded. The packages are selected
/// together with those that share a build, so that the program uses the crates of that build.
pub fn guides(wanted: &str, chosen: &[&str]) -> Invocation {
    let arguments = [&shared_packages()[..], &["--test", "guides", "--"], chosen];
    cargo_test(&arguments.concat()).env("BITTYBUZZ_GUIDES", wanted)
}

/// Packages that are tested with optimization, as they are used.
pub const EMULATORS: [&str; 7] = [
    "bittybuzz-core-tests",
    "bittybuzz-emulate-avr",
    "bittybuzz-emulate-qemu",
    "bittybuzz-emulate-stm32",
    "bittybuzz-qemu",
    "bittybuzz-simavr",
    "bittybuzz-unicorn",
];

/// The package of the book. Most crates that it compiles have no other user.
pub const BOOK: &str = "bittybuzz-book";

/// The package without code that gives shared crates the features of all tests.
pub const FEATURES: &str = "bittybuzz-features";

/// The package of the Python module, which alone needs Python. Its tests are in Python.
pub const PYTHON: &str = "bittybuzz-python";

/// Returns the options that select all packages that share a build of their tests.
pub fn shared_packages() -> Vec<&'static str> {
    all_but_emulators().into_iter().chain(["--exclude", BOOK, "--exclude", PYTHON]).collect()
}

/// Returns the options that select [`EMULATORS`].
pub fn emulators() -> Vec<&'static str> {
    EMULATORS.map(|package| ["--package", package]).concat()
}

/// Returns the options that select all packages but [`EMULATORS`].
pub fn all_but_emulators() -> Vec<&'static str> {
    [&["--workspace"], EMULATORS.map(|package| ["--exclude", package]).as_flattened()].concat()
}

/// Returns the tests of all packages that share a build, with options for cargo and arguments for
/// the test programs. To run only the tests of one package, select its program by `--test`: with
/// `--package`, cargo would compile the shared crates once more with fewer features.
pub fn all_tests(options: &[&str], chosen: &[&str]) -> Invocation {
    cargo_test(&[&shared_packages()[..], options, &["--"], chosen].concat())
}

/// The variable that names the program `bbz` for tests that run it. They build it otherwise, alone,
/// so that cargo compiles the shared crates once more with fewer features.
pub const BBZ: &str = "BITTYBUZZ_BBZ";

/// Builds `bbz` with the packages that share a build of their tests. Returns its path.
pub fn bbz() -> Result<PathBuf> {
    // The tests of a package include its programs.
    all_tests(&["--no-run", "--quiet", "--test", "bbz"], &[]).run()?;
    Ok(target()?.join("debug").join(format!("bbz{EXE_SUFFIX}")))
}

/// Builds the program of the chores with the packages that share a build of their tests, which then
/// use the crates that it needs. Returns its path.
pub fn xtask() -> Result<PathBuf> {
    // Before the test of a program, cargo builds the program.
    all_tests(&["--no-run", "--quiet", "--test", "steps"], &[]).unannounced().run()?;
    Ok(target()?.join("debug").join(format!("xtask{EXE_SUFFIX}")))
}

/// Returns the tests of `tests/hil`, with arguments for their program.
pub fn image_tests(chosen: &[&str]) -> Result<Invocation> {
    let bbz = bbz()?.display().to_string();
    Ok(all_tests(&["--test", "hil"], chosen).env(BBZ, &bbz))
}
