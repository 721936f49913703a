//! `cargo test`, as every chore calls it.

use crate::shell::Line;

/// Arguments that leave out the slower of the emulated processors, and the guides, which build everything once more.
pub const SKIP_SLOW: [&str; 4] = ["--skip", "qemu", "--skip", "guide_to"];

/// `cargo test` with these arguments. Properties are tested with the same cases each time, so that a failure
/// comes from the change under test; `cargo xtask soak properties` tries other cases.
pub fn cargo_test(arguments: &[&str]) -> Line {
    Line::cargo(&[&["test"], arguments].concat()).env("PROPTEST_RNG_SEED", "1")
}

/// Packages that are tested optimised, as they are used.
pub const EMULATORS: [&str; 7] = [
    "bittybuzz-core-tests",
    "bittybuzz-emulate-avr",
    "bittybuzz-emulate-qemu",
    "bittybuzz-emulate-stm32",
    "bittybuzz-qemu",
    "bittybuzz-simavr",
    "bittybuzz-unicorn",
];

/// The tests of all packages that share a build, with arguments for cargo and for the programs of tests. Who wants some of them chooses
/// by `--test`: for one package alone cargo would compile the crates that it shares with others once more, with fewer features.
pub fn all_tests(options: &[&str], chosen: &[&str]) -> Line {
    let all = ["--workspace", "--exclude", "bittybuzz-probe-rs-test"];
    let but = EMULATORS.map(|package| ["--exclude", package]).concat();
    cargo_test(&[&all[..], &but, options, &["--"], chosen].concat())
}
