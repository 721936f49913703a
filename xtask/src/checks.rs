//! Tests, and what CI runs.

use crate::board::CRAZYFLIE;
use crate::failure::Failure;
use crate::shell::{Line, cargo};
use crate::{setup, sizes, soak};
use std::path::Path;

/// The tests of every crate that builds on the host, and the Crazyflie's firmware on the faster emulated processor.
pub fn test() -> Result<(), Failure> {
    setup::run()?;
    tests(&[]).run()?;
    let image = CRAZYFLIE.build(None, false)?;
    hardware_in_the_loop(&image, &["--skip", "qemu"]).run()
}

/// `cargo test` with these arguments.
pub fn tests(arguments: &[&str]) -> Line {
    // Optimised enough to be quick, and still checked for overflow.
    Line::new("cargo", &[&["test"], arguments].concat()).env("CARGO_PROFILE_DEV_OPT_LEVEL", "1")
}

/// The tests of a Crazyflie's image; the arguments choose among them.
pub fn hardware_in_the_loop(image: &Path, arguments: &[&str]) -> Line {
    tests(&[&["--package", "bittybuzz-hil", "--"], arguments].concat())
        .env("BITTYBUZZ_CRAZYFLIE", &image.display().to_string())
}

/// Everything that must pass before a change is merged.
pub fn ci() -> Result<(), Failure> {
    setup::run()?;
    lint()?;
    tests(&[]).run()?;
    cargo(&["test", "--package", "xtask"])?;
    no_panic()?;
    sizes::run(&[])?;
    // Optimised, as they are used: the processor is compiled once.
    let emulators = ["--package", "bittybuzz-emulate-stm32", "--package", "bittybuzz-emulate-qemu"];
    cargo(&[&["test", "--release"], &emulators[..]].concat())?;
    let image = CRAZYFLIE.build(None, false)?;
    hardware_in_the_loop(&image, &[]).run()?;
    tests(&["--package", "bittybuzz-probe-rs-test"]).run()?;
    soak::sample()
}

/// Format and lints of every workspace.
fn lint() -> Result<(), Failure> {
    const DENY: [&str; 3] = ["--", "-D", "warnings"];
    cargo(&["fmt", "--all", "--check"])?;
    // Optimised like the emulators that follow, so that their processor is compiled once.
    cargo(&[&["clippy", "--workspace", "--all-targets", "--release"], &DENY[..]].concat())?;
    // A robot may leave out parts of the machine.
    for features in ["", "maths"] {
        let leave_out = ["clippy", "--package", "bittybuzz-vm-core", "--no-default-features"];
        cargo(&[&leave_out[..], &["--features", features], &DENY].concat())?;
    }
    let firmware =
        |arguments: &[&str]| Line::new("cargo", arguments).in_workspace(CRAZYFLIE.folder).run();
    firmware(&["fmt", "--check"])?;
    firmware(&[&["clippy", "--release"], &DENY[..]].concat())
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
