//! `cargo test`, as every chore calls it.

use crate::shell::Line;

/// Arguments that leave out the slower of the emulated processors, and the guides, which build everything once more.
pub const SKIP_SLOW: [&str; 4] = ["--skip", "qemu", "--skip", "guide_to"];

/// `cargo test` with these arguments. Properties are tested with the same cases each time, so that a failure
/// comes from the change under test; `cargo xtask soak properties` tries other cases.
pub fn cargo_test(arguments: &[&str]) -> Line {
    Line::cargo(&[&["test"], arguments].concat()).env("PROPTEST_RNG_SEED", "1")
}
