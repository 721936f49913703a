//! `cargo test` with the settings of all chores.

use crate::shell::Invocation;

/// Arguments that skip the tests on the slower emulated processors, and the guides, which build
/// everything once more.
pub const SKIP_SLOW: [&str; 4] = ["--skip", "qemu", "--skip", "guide_to"];

/// Returns `cargo test` with these arguments. Property tests use the same cases each time, so that
/// a failure comes from the change under test; `cargo xtask soak properties` tries other cases.
pub fn cargo_test(arguments: &[&str]) -> Invocation {
    Invocation::cargo(&[&["test"], arguments].concat()).env("PROPTEST_RNG_SEED", "1")
}

/// Packages that are tested with optimisation, as they are used.
pub const EMULATORS: [&str; 7] = [
    "bittybuzz-core-tests",
    "bittybuzz-emulate-avr",
    "bittybuzz-emulate-qemu",
    "bittybuzz-emulate-stm32",
    "bittybuzz-qemu",
    "bittybuzz-simavr",
    "bittybuzz-unicorn",
];

/// Returns the tests of all packages that share a build, with options for cargo and arguments for
/// the test programs. To run only some tests, select them by `--test`: for a single package, cargo
/// would compile the shared crates once more with fewer features.
pub fn all_tests(options: &[&str], chosen: &[&str]) -> Invocation {
    let all = ["--workspace", "--exclude", "bittybuzz-probe-rs-test"];
    let but = EMULATORS.map(|package| ["--exclude", package]).concat();
    cargo_test(&[&all[..], &but, options, &["--"], chosen].concat())
}
