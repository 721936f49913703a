//! Tests, and what CI runs.

use crate::board::{BOARDS, CRAZYFLIE, KILOBOT, ZOOIDS};
use crate::failure::Failure;
use crate::probe::PROBES;
use crate::shell::{Line, cargo};
use crate::{bench, on_chip, setup, sizes, soak};
use std::path::Path;

/// Not with every change: the slower of the emulated processors, and the guides, which build everything once more.
pub const SKIP_SLOW: [&str; 4] = ["--skip", "qemu", "--skip", "a_new_robot"];

/// Random programs of every change.
const SEEDS: &str = "0..100";

/// The tests on this computer, and those of the robots' firmware on the faster emulated processor.
pub fn test() -> Result<(), Failure> {
    setup::run()?;
    let image = CRAZYFLIE.build(None, false)?;
    all_tests(&image, &SKIP_SLOW)?.env("BITTYBUZZ_SEEDS", SEEDS).run()
}

/// All that share a build; the arguments choose among them. In one call, because cargo would compile what they have in
/// common once for each.
fn all_tests(image: &Path, arguments: &[&str]) -> Result<Line, Failure> {
    let all = ["--workspace", "--exclude", "bittybuzz-probe-rs-test"];
    // These are tested optimised, as they are used.
    let but = EMULATORS.map(|package| ["--exclude", package]).concat();
    with_image(tests(&[&all[..], &but, &["--"], arguments].concat()), image)
}

/// The other robots' images are always those of the sources.
fn with_image(line: Line, image: &Path) -> Result<Line, Failure> {
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

/// `cargo test` with these arguments. Properties are tested with the same cases each time, so that a failure
/// comes from the change under test; `soak properties` tries other cases.
pub fn tests(arguments: &[&str]) -> Line {
    quick(&[&["test"], arguments].concat()).env("PROPTEST_RNG_SEED", "1")
}

/// Cargo, for what is built to run a short while.
pub fn quick(arguments: &[&str]) -> Line {
    // Optimised enough to be quick, and still checked for overflow; places in backtraces, but no variables.
    Line::new("cargo", arguments)
        .env("CARGO_PROFILE_DEV_OPT_LEVEL", "1")
        .env("CARGO_PROFILE_DEV_DEBUG", "line-tables-only")
}

const EMULATORS: [&str; 3] =
    ["bittybuzz-emulate-avr", "bittybuzz-emulate-stm32", "bittybuzz-emulate-qemu"];

/// Everything that must pass before a change is merged.
pub fn ci() -> Result<(), Failure> {
    setup::run()?;
    lint()?;
    no_panic()?;
    sizes::run(&[])?;
    bench::check()?;
    on_chip::sample()?;
    // The processor is compiled once, for lints, these and all that follow.
    let emulators = EMULATORS.map(|package| ["--package", package]).concat();
    cargo(&[&["test", "--release"], &emulators[..]].concat())?;
    let image = CRAZYFLIE.build(None, false)?;
    all_tests(&image, &[])?.run()?;
    tests(&["--package", "bittybuzz-probe-rs-test"]).run()?;
    soak::sample()
}

/// Format and lints of every workspace.
fn lint() -> Result<(), Failure> {
    const DENY: [&str; 3] = ["--", "-D", "warnings"];
    cargo(&["fmt", "--all", "--check"])?;
    let probes = PROBES.map(|probe| probe.folder);
    for folder in bench::WORKSPACES.into_iter().chain(on_chip::WORKSPACES).chain(probes) {
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
fn no_panic() -> Result<(), Failure> {
    for probe in PROBES {
        for extent in probe.extents() {
            probe.build(*extent, false)?;
        }
    }
    Ok(())
}
