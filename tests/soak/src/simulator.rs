//! The simulator that runs scenarios.

use anyhow::Result;
use bittybuzz_builds::shell::{Invocation, target};
use std::path::PathBuf;

/// The profile with which the simulator is compiled.
#[derive(Clone, Copy)]
pub enum Build {
    /// The profile of users.
    Optimized,
    /// The profile of tests, with checks of overflow. CI has built most of it for the tests.
    Checked,
}

/// The packages, always built together: cargo would compile their shared crates again for each
/// selection of them.
const PROGRAMS: [&str; 3] = ["bbz", "bittybuzz-emulate-avr", "bittybuzz-emulate-m0"];

impl Build {
    /// Builds `bbz` and the emulator programs; returns the path of `bbz`.
    pub fn simulator(self) -> Result<PathBuf> {
        let mut arguments = vec!["build", "--quiet"];
        arguments.extend(PROGRAMS.iter().flat_map(|name| ["--package", name]));
        let folder = match self {
            Build::Optimized => {
                arguments.push("--release");
                "release"
            }
            Build::Checked => "debug",
        };
        Invocation::cargo(&arguments).run()?;
        Ok(target()?.join(folder).join("bbz"))
    }
}
