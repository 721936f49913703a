//! Tests, and what CI runs.

use crate::setup;
use crate::shell::{Failure, Line, cargo};

/// The tests of every crate that builds on the host.
pub fn test() -> Result<(), Failure> {
    // Optimised enough to be quick, and still checked for overflow.
    Line::new("cargo", &["test"]).env("CARGO_PROFILE_DEV_OPT_LEVEL", "1").run()
}

/// Everything that must pass before a change is merged.
pub fn ci() -> Result<(), Failure> {
    setup::run()?;
    cargo(&["fmt", "--all", "--check"])?;
    cargo(&["clippy", "--workspace", "--all-targets", "--", "-D", "warnings"])?;
    // A robot may leave out parts of the machine.
    for features in ["", "maths"] {
        let leave_out = ["clippy", "--package", "bittybuzz-vm-core", "--no-default-features"];
        let arguments =
            [&leave_out[..], &["--features", features, "--", "-D", "warnings"]].concat();
        cargo(&arguments)?;
    }
    test()?;
    cargo(&["test", "--package", "xtask"])?;
    no_panic()
}

/// Links the virtual machine for the chips of the STM32 robots with a panic handler that does not exist: fails if a panic is
/// left in it.
fn no_panic() -> Result<(), Failure> {
    for target in ["thumbv6m-none-eabi", "thumbv7em-none-eabihf"] {
        for features in ["", "maths", "maths,strings,full"] {
            let arguments = ["build", "--release", "--target", target, "--features", features];
            Line::new("cargo", &arguments).in_workspace("firmware/probe-cortex-m").run()?;
        }
    }
    Ok(())
}
