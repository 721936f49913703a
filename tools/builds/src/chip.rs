//! Builds programs for chips that belong to no robot, in the workspaces below `targets`.

use crate::board::target_of;
use crate::shell::Invocation;
use anyhow::Result;
use std::path::PathBuf;

/// The folders of all workspaces, from the root.
pub const WORKSPACES: [&str; 2] = [AVR, CORTEX_M];

/// The folder of the programs for an AVR, whose `rust-toolchain.toml` is that of the Kilobot.
pub const AVR: &str = "targets/avr";
const CORTEX_M: &str = "targets/cortex-m";

/// The compiler's target name of the AVR.
pub const AVR_NONE: &str = "avr-none";

/// A program of a package of these workspaces.
#[derive(Clone, Copy, Debug)]
pub struct ChipProgram {
    /// The package, which has the same name as the program.
    pub package: &'static str,
    /// The compiler's target name of the chip's core.
    pub target: &'static str,
    /// Features of the package, separated by commas.
    pub features: &'static str,
}

/// Lints the programs of all workspaces for the target that their `.cargo/config.toml` names; clippy
/// gets these arguments.
pub fn lint(deny: &[&str]) -> Result<()> {
    let arguments = [&["clippy", "--workspace", "--release"], deny].concat();
    WORKSPACES
        .iter()
        .try_for_each(|folder| Invocation::cargo(&arguments).in_workspace(folder).run())
}

impl ChipProgram {
    /// Builds the program with these environment variables, and returns the ELF file.
    pub fn build(self, environment: &[(&str, &str)], quiet: bool) -> Result<PathBuf> {
        let ChipProgram { package, target, features } = self;
        let is_avr = target == AVR_NONE;
        let folder = if is_avr { AVR } else { CORTEX_M };
        let arguments = ["build", "--release", "--package", package, "--target", target];
        let arguments = [&arguments[..], &["--features", features]].concat();
        let line = Invocation::cargo(&arguments).in_workspace(folder);
        let line = environment.iter().fold(line, |line, (name, value)| line.env(name, value));
        if quiet { line.unannounced() } else { line }.run()?;
        let file = if is_avr { format!("{package}.elf") } else { package.to_owned() };
        Ok(target_of(folder).join(target).join("release").join(file))
    }
}
