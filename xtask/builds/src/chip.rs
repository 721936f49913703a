//! Programs for chips that belong to no robot: the workspaces below `targets`.

use crate::board::target_of;
use crate::shell::Line;
use anyhow::Result;
use std::path::PathBuf;

/// All of them.
pub const WORKSPACES: [&str; 2] = [AVR, CORTEX_M];

const AVR: &str = "targets/avr";
const CORTEX_M: &str = "targets/cortex-m";

/// The compiler's name of the AVR.
pub const AVR_NONE: &str = "avr-none";

/// A program of a package of these workspaces.
#[derive(Clone, Copy, Debug)]
pub struct Program {
    /// Its package, which is named as the program.
    pub package: &'static str,
    /// The compiler's name of the chip's core.
    pub target: &'static str,
    /// Features of the package, separated by commas.
    pub features: &'static str,
}

impl Program {
    /// Builds it with these environment variables; returns the ELF file.
    pub fn build(self, environment: &[(&str, &str)], quiet: bool) -> Result<PathBuf> {
        let Program { package, target, features } = self;
        let is_avr = target == AVR_NONE;
        let folder = if is_avr { AVR } else { CORTEX_M };
        let arguments = ["build", "--release", "--package", package, "--target", target];
        let arguments = [&arguments[..], &["--features", features]].concat();
        let line = Line::cargo(&arguments);
        // The AVR has no standard library ready; cargo builds one, which it does not promise to go on doing.
        let line = if is_avr { line.env("RUSTC_BOOTSTRAP", "1") } else { line };
        let line = environment.iter().fold(line, |line, (name, value)| line.env(name, value));
        let line = line.in_workspace(folder);
        if quiet { line.unannounced() } else { line }.run()?;
        let file = if is_avr { format!("{package}.elf") } else { package.to_owned() };
        Ok(target_of(folder).join(target).join("release").join(file))
    }
}
