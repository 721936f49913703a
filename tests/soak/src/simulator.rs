//! The simulator that runs scenarios, and the emulators that it starts.

use anyhow::Result;
use bittybuzz_builds::cargo_test;
use bittybuzz_builds::shell::{Invocation, target};
use std::path::PathBuf;

/// The profile with which the simulator is compiled. Emulators are always optimized.
#[derive(Clone, Copy)]
pub enum Build {
    /// The profile of users.
    Optimized,
    /// The profile of tests, with checks of overflow. CI has built it for the tests.
    Checked,
}

const EMULATORS: [&str; 2] = ["bittybuzz-emulate-avr", "bittybuzz-emulate-m0"];

impl Build {
    /// Builds `bbz` and the emulator programs; returns the path of `bbz`.
    pub fn simulator(self) -> Result<PathBuf> {
        let (packages, bbz) = match self {
            Build::Optimized => (&["--package", "bbz"][..], target()?.join("release/bbz")),
            Build::Checked => (&[][..], cargo_test::bbz()?),
        };
        let emulators = EMULATORS.map(|package| ["--package", package]).concat();
        let build = ["build", "--release", "--quiet"];
        Invocation::cargo(&[&build[..], packages, &emulators].concat()).run()?;
        Ok(bbz)
    }
}

/// Returns the path of the emulator of an AVR.
pub fn avr() -> Result<PathBuf> {
    Ok(target()?.join("release/bbz-emulate-avr"))
}
