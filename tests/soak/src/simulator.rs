//! The simulator that runs scenarios.

use anyhow::Result;
use bittybuzz_builds::shell::{Invocation, target};
use std::path::PathBuf;

/// How it is compiled.
#[derive(Clone, Copy)]
pub enum Build {
    /// As users run it.
    Optimised,
    /// As tests run it, with checks of overflow. CI has most of it from the tests.
    Checked,
}

/// Always together: cargo would compile their shared crates again for each choice among them.
const PROGRAMS: [&str; 3] = ["bbz", "bittybuzz-emulate-avr", "bittybuzz-emulate-m0"];

impl Build {
    /// Builds `bbz` and the emulator programs; returns where `bbz` is.
    pub fn simulator(self) -> Result<PathBuf> {
        let mut arguments = vec!["build", "--quiet"];
        arguments.extend(PROGRAMS.iter().flat_map(|name| ["--package", name]));
        let folder = match self {
            Build::Optimised => {
                arguments.push("--release");
                "release"
            }
            Build::Checked => "debug",
        };
        Invocation::cargo(&arguments).run()?;
        Ok(target()?.join(folder).join("bbz"))
    }
}
