//! QEMU: counts the instructions that a Cortex-M executes, and stops it at each mark.

use crate::error::BenchError;
use crate::images::CompiledScript;
use crate::marks::{MarkRecord, ReportedMark};
use anyhow::Result;
use bittybuzz_bench::Mark;
use bittybuzz_emulation::ElfSymbol;
use bittybuzz_qemu::qemu::{Qemu, QemuError};
use bittybuzz_qemu::registers::CoreRegisters;
use fs_err as fs;
use std::ffi::OsStr;
use std::path::Path;

pub const RUNNER: &str = "qemu-system-arm";

/// A machine with a Cortex-M0.
pub const M0: &str = "microbit";
/// A machine with a Cortex-M4F.
pub const M4F: &str = "mps2-an386";

/// The function that a program calls to mark a place.
const MARK: &str = "bench_mark";
/// The number of times that the debugger's client may time out, after some seconds each, between
/// two marks.
const TRIES: u32 = 24;

/// Runs a program with a script in it.
pub fn run(machine: &str, program: &Path, script: &CompiledScript) -> Result<ReportedMark> {
    let events = record(machine, program, &script.name)?;
    let told = ReportedMark::from_events(&events);
    told.ok_or_else(|| BenchError::Silent { name: script.name.clone() }.into())
}

/// Runs a program, and returns all its marks.
pub fn record(machine: &str, program: &Path, name: &str) -> Result<Vec<MarkRecord>> {
    let no_symbol = || BenchError::NoSymbol { program: program.into(), symbol: MARK };
    let mark = ElfSymbol::find(&fs::read(program)?, |name| name == MARK).ok_or_else(no_symbol)?;
    let events = watch(machine, program, mark.address).map_err(BenchError::Qemu)?;
    events.ok_or_else(|| BenchError::Silent { name: name.to_owned() }.into())
}

/// Returns the marks up to the last one; `None` if one is missing.
fn watch(machine: &str, program: &Path, at: u32) -> Result<Option<Vec<MarkRecord>>, QemuError> {
    let mut qemu = Qemu::start(machine, &[OsStr::new("-kernel"), program.as_os_str()])?;
    qemu.gdb.set_breakpoint(at)?;
    let (mut registers, _) = qemu.registers_and_count()?;
    let mut next = registers.clone();
    let mut events = Vec::new();
    loop {
        qemu.gdb.resume(&registers, &next)?;
        let mut stop = None;
        for _ in 0..TRIES {
            stop = qemu.gdb.wait()?;
            if stop.is_some() {
                break;
            }
        }
        if stop.is_none() {
            return Ok(None);
        }
        let (seen, executed) = qemu.registers_and_count()?;
        let Some(mark) = Mark::numbered(seen.r[0]) else { return Ok(None) };
        events.push(MarkRecord { at: executed, mark, value: seen.r[1] });
        if !matches!(mark, Mark::Begin | Mark::End) {
            return Ok(Some(events));
        }
        next = seen.clone();
        next.r[usize::from(CoreRegisters::PC)] = seen.r[usize::from(CoreRegisters::LR)] & !1;
        registers = seen;
    }
}
