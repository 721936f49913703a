//! Images do on chips what they do on the host: builds the chips' programs of tests/on-chip, and has the test there feed
//! them.

use crate::board::target_of;
use crate::cargo_test::cargo_test;
use crate::shell::Line;
use anyhow::Result;
use std::path::PathBuf;

/// The chips' programs' own workspaces.
pub const WORKSPACES: [&str; 2] = [AVR, CORTEX_M];

const AVR: &str = "tests/on-chip/avr";
const CORTEX_M: &str = "tests/on-chip/cortex-m";

/// A chip with a profile, and what plays it; the test knows it by the name.
pub struct Target {
    /// Its name.
    pub name: &'static str,
    /// Workspace of its program.
    folder: &'static str,
    triple: &'static str,
    full: bool,
}

const fn avr(name: &'static str) -> Target {
    Target { name, folder: AVR, triple: "avr-none", full: false }
}

const fn cortex_m(name: &'static str, triple: &'static str, full: bool) -> Target {
    Target { name, folder: CORTEX_M, triple, full }
}

/// All of them.
pub const TARGETS: [Target; 6] = [
    avr("avr"),
    avr("avr-qemu"),
    cortex_m("thumbv6m", "thumbv6m-none-eabi", false),
    cortex_m("thumbv7em", "thumbv7em-none-eabihf", false),
    cortex_m("thumbv6m-full", "thumbv6m-none-eabi", true),
    cortex_m("thumbv7em-full", "thumbv7em-none-eabihf", true),
];

/// Generated programs of every merge.
const SAMPLE: &str = "0..200";

/// The conformance scripts and some generated programs on every target.
pub fn sample() -> Result<()> {
    for target in TARGETS {
        for seeds in [None, Some(SAMPLE)] {
            println!("{}: {}", target.name, target.compare(seeds)?);
        }
    }
    Ok(())
}

impl Target {
    /// Compares it with the host: the generated programs of these seeds, or the conformance scripts. What was run.
    pub fn compare(&self, seeds: Option<&str>) -> Result<String> {
        let program = self.build()?;
        let arguments = ["--package", "bittybuzz-on-chip", "--test", "same"];
        let all = [&arguments[..], &["--", "--ignored", "--nocapture"]].concat();
        let test = cargo_test(&all)
            .env("BITTYBUZZ_TARGET", self.name)
            .env("BITTYBUZZ_PROGRAM", &program.display().to_string());
        let test = match seeds {
            Some(seeds) => test.env("BITTYBUZZ_SEEDS", seeds),
            None => test,
        };
        let output = test.output(0)?;
        let output = String::from_utf8_lossy(&output.stdout).into_owned();
        let summary = output.lines().find_map(|line| line.strip_prefix("compared: "));
        Ok(summary.unwrap_or("all the same").to_owned())
    }

    fn build(&self) -> Result<PathBuf> {
        let features = if self.full { "full" } else { "" };
        let arguments = ["build", "--release", "--target", self.triple, "--features", features];
        let line = Line::new("cargo", &arguments).in_workspace(self.folder).unannounced();
        // The AVR has no standard library ready; cargo builds one, which it does not promise to go on doing.
        let is_avr = self.folder == AVR;
        if is_avr { line.env("RUSTC_BOOTSTRAP", "1") } else { line }.run()?;
        let file = if is_avr { "on-chip-avr.elf" } else { "on-chip-cortex-m" };
        Ok(target_of(self.folder).join(self.triple).join("release").join(file))
    }
}
