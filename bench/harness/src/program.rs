//! The programs that run scripts: they are linked once, and then get the image of each script.

use crate::error::BenchError;
use crate::images::CompiledScript;
use crate::marks::ReportedMark;
use crate::target::BenchTarget;
use crate::{avr, cortex_m, host};
use anyhow::Result;
use bittybuzz_bench::SYMBOL;
use bittybuzz_builds::board::target_of;
use bittybuzz_builds::chip::{self, AVR_NONE};
use bittybuzz_builds::shell::{Invocation, is_installed, target};
use bittybuzz_emulation::ElfSymbol;
use fs_err as fs;
use std::path::PathBuf;

/// The workspace of the program for this computer.
pub const HOST: &str = "bench/host";

/// Returns the program of a chip; `None` for this computer.
fn of_chip(target: BenchTarget) -> Option<chip::ChipProgram> {
    const V6M: &str = "thumbv6m-none-eabi";
    const V7EM: &str = "thumbv7em-none-eabihf";
    let cortex_m =
        |target, features| Some(chip::ChipProgram { package: "bench-cortex-m", target, features });
    match target {
        BenchTarget::Host => None,
        BenchTarget::Avr => {
            Some(chip::ChipProgram { package: "bench-avr", target: AVR_NONE, features: "" })
        }
        BenchTarget::Thumbv6m => cortex_m(V6M, ""),
        BenchTarget::Thumbv7em => cortex_m(V7EM, ""),
        BenchTarget::Thumbv6mFull => cortex_m(V6M, "full"),
        BenchTarget::Thumbv7emFull => cortex_m(V7EM, "full"),
    }
}

/// Returns the emulator, or Callgrind, that runs the program of a target.
fn runner(target: BenchTarget) -> &'static str {
    match target {
        BenchTarget::Host => host::RUNNER,
        BenchTarget::Avr => avr::RUNNER,
        _ => cortex_m::RUNNER,
    }
}

/// Builds the program for this computer.
fn build_for_host() -> Result<PathBuf> {
    Invocation::cargo(&["build", "--release"]).in_workspace(HOST).unannounced().run()?;
    Ok(target_of(HOST).join("release/bench-host"))
}

/// A linked program.
pub struct LinkedProgram {
    target: BenchTarget,
    path: PathBuf,
    bytes: Vec<u8>,
    /// The folder of intermediate files.
    folder: PathBuf,
}

impl LinkedProgram {
    /// Builds the program of a target.
    pub fn build(target: BenchTarget) -> Result<LinkedProgram> {
        let program = runner(target);
        if !is_installed(program) {
            return Err(BenchError::Missing { program }.into());
        }
        let path = match of_chip(target) {
            Some(program) => program.build(&[], true)?,
            None => build_for_host()?,
        };
        let bytes = fs::read(&path)?;
        let folder = self::target()?.join("bench");
        fs::create_dir_all(&folder)?;
        Ok(LinkedProgram { target, path, bytes, folder })
    }

    /// Runs a script.
    pub fn run(&self, script: &CompiledScript) -> Result<ReportedMark> {
        let block = script.block()?;
        if self.target == BenchTarget::Host {
            let file = self.write("script", &block)?;
            return host::run(&self.path, &file, &self.folder);
        }
        let file = self.write("program", &self.with(&block)?)?;
        match self.target {
            BenchTarget::Avr => avr::run(&file, &self.folder),
            BenchTarget::Thumbv6m | BenchTarget::Thumbv6mFull => {
                cortex_m::run(cortex_m::M0, &file, script)
            }
            _ => cortex_m::run(cortex_m::M4F, &file, script),
        }
    }

    /// Returns the program with a script in it.
    fn with(&self, block: &[u8]) -> Result<Vec<u8>, BenchError> {
        let no_symbol = || BenchError::NoSymbol { program: self.path.clone(), symbol: SYMBOL };
        let symbol = ElfSymbol::find(&self.bytes, |name| name == SYMBOL);
        let room = symbol.and_then(|symbol| symbol.file_range);
        let mut bytes = self.bytes.clone();
        let room = bytes.get_mut(room.ok_or_else(no_symbol)?).ok_or_else(no_symbol)?;
        room[..block.len()].copy_from_slice(block);
        Ok(bytes)
    }

    fn write(&self, name: &str, bytes: &[u8]) -> Result<PathBuf> {
        let path = self.folder.join(name);
        fs::write(&path, bytes)?;
        Ok(path)
    }
}
