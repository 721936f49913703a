//! Tests, and what CI runs.

use crate::sizes;
use anyhow::Result;
use bittybuzz_bench_harness as bench;
use bittybuzz_builds::board::{BOARDS, CRAZYFLIE, KILOBOT, ZOOIDS};
use bittybuzz_builds::cargo_test::{SKIP_SLOW, cargo_test};
use bittybuzz_builds::probe::PROBES;
use bittybuzz_builds::shell::{Line, cargo};
use bittybuzz_builds::{chip, on_chip, setup};
use bittybuzz_soak as soak;
use std::path::Path;

/// How long `test` takes the first time.
const MINUTES: u32 = 20;

/// Random programs of every change.
const SEEDS: &str = "0..100";

/// The tests on this computer, and those of the robots' firmware on the faster emulated processor.
pub fn test() -> Result<()> {
    setup::run()?;
    println!(
        "The tests follow: {MINUTES} minutes on two cores the first time, with all that is built."
    );
    let image = CRAZYFLIE.build(None, false)?;
    all_tests(&image, &SKIP_SLOW)?.env("BITTYBUZZ_SEEDS", SEEDS).run()
}

/// All that share a build; the arguments choose among them. In one call, because cargo would compile what they have in
/// common once for each.
fn all_tests(image: &Path, arguments: &[&str]) -> Result<Line> {
    let all = ["--workspace", "--exclude", "bittybuzz-probe-rs-test"];
    // These are tested optimised, as they are used.
    let but = EMULATORS.map(|package| ["--exclude", package]).concat();
    with_image(cargo_test(&[&all[..], &but, &["--"], arguments].concat()), image)
}

/// The other robots' images are always those of the sources.
fn with_image(line: Line, image: &Path) -> Result<Line> {
    let behaviours = KILOBOT.build_behaviours(false)?;
    let [zooids, kilobot] = [ZOOIDS.build(None, false)?, KILOBOT.build(None, false)?];
    let tiny = CRAZYFLIE.build_tiny(None)?;
    Ok(line
        .env("BITTYBUZZ_CRAZYFLIE_TINY", &tiny.display().to_string())
        .env("BITTYBUZZ_CRAZYFLIE", &image.display().to_string())
        .env("BITTYBUZZ_ZOOIDS", &zooids.display().to_string())
        .env("BITTYBUZZ_KILOBOT", &kilobot.display().to_string())
        .env("BITTYBUZZ_BEHAVIOURS", &behaviours.display().to_string()))
}

const EMULATORS: [&str; 3] =
    ["bittybuzz-emulate-avr", "bittybuzz-emulate-stm32", "bittybuzz-emulate-qemu"];

/// Everything that must pass before a change is merged.
pub fn ci() -> Result<()> {
    setup::run()?;
    lint()?;
    no_panic()?;
    sizes::run(false)?;
    bench::check()?;
    on_chip::sample()?;
    // The processor is compiled once, for lints, these and all that follow.
    let emulators = EMULATORS.map(|package| ["--package", package]).concat();
    cargo(&[&["test", "--release"], &emulators[..]].concat())?;
    let image = CRAZYFLIE.build(None, false)?;
    all_tests(&image, &[])?.run()?;
    cargo_test(&["--package", "bittybuzz-probe-rs-test"]).run()?;
    soak::sample()
}

/// Format and lints of every workspace.
fn lint() -> Result<()> {
    const DENY: [&str; 3] = ["--", "-D", "warnings"];
    cargo(&["fmt", "--all", "--check"])?;
    for folder in [bench::HOST].into_iter().chain(chip::WORKSPACES) {
        Line::new("cargo", &["fmt", "--check"]).in_workspace(folder).run()?;
    }
    soak::lint_fuzz_targets(&DENY)?;
    cargo(&[&["clippy", "--workspace", "--all-targets", "--release"], &DENY[..]].concat())?;
    // A robot may leave out parts of the machine.
    for features in ["", "maths"] {
        let leave_out = ["clippy", "--package", "bittybuzz-vm-core", "--no-default-features"];
        cargo(&[&leave_out[..], &["--features", features], &DENY].concat())?;
    }
    for board in BOARDS {
        let firmware =
            |arguments: &[&str]| Line::new("cargo", arguments).in_workspace(board.folder).run();
        firmware(&["fmt", "--check"])?;
        firmware(&[&["clippy", "--release"], &DENY[..]].concat())?;
    }
    Ok(())
}

/// Links the virtual machine for the robots' cores with a panic handler that does not exist: fails if a panic is left in
/// it.
fn no_panic() -> Result<()> {
    for probe in PROBES {
        for extent in probe.extents() {
            probe.build(*extent, false)?;
        }
    }
    Ok(())
}
