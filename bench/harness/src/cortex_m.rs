//! QEMU: counts the instructions that a Cortex-M executes, up to each mark.
//!
//! A mark is a system call by semihosting (targets/cortex-m/debugger), which QEMU forwards to its
//! debugger. While the call waits for its result, the core is stopped, so its registers and the
//! count can be read. A breakpoint would do the same, but costs fifteen times as much: QEMU 7.2
//! discards its translated code at each.

use crate::error::BenchError;
use crate::images::CompiledScript;
use crate::marks::{MarkRecord, ReportedMark};
use anyhow::Result;
use bittybuzz_bench::Mark;
use bittybuzz_qemu::qemu::{Qemu, QemuError};
use std::ffi::OsStr;
use std::path::Path;

pub const RUNNER: &str = "qemu-system-arm";

/// A machine with a Cortex-M0.
pub const M0: &str = "microbit";
/// A machine with a Cortex-M4F.
pub const M4F: &str = "mps2-an386";

/// Arguments of QEMU that make it forward system calls to the debugger.
const FORWARD_CALLS: [&str; 2] = ["-semihosting-config", "enable=on,target=gdb"];
/// The number of registers that hold a mark and its value during the call.
const MARK_REGISTER: usize = 2;
const VALUE_REGISTER: usize = 3;
/// The result of the call: the number of bytes written.
const WRITTEN: u32 = 1;

/// Runs a program with a script in it.
pub fn run(machine: &str, program: &Path, script: &CompiledScript) -> Result<ReportedMark> {
    let events = record(machine, program, &script.name)?;
    let told = ReportedMark::from_events(&events);
    told.ok_or_else(|| BenchError::Silent { name: script.name.clone() }.into())
}

/// Runs a program, and returns all its marks.
pub fn record(machine: &str, program: &Path, name: &str) -> Result<Vec<MarkRecord>> {
    let events = watch(machine, program).map_err(BenchError::Qemu)?;
    events.ok_or_else(|| BenchError::Silent { name: name.to_owned() }.into())
}

/// Returns the marks up to the last one; `None` if one is missing.
fn watch(machine: &str, program: &Path) -> Result<Option<Vec<MarkRecord>>, QemuError> {
    let [option, value] = FORWARD_CALLS.map(OsStr::new);
    let arguments = [OsStr::new("-kernel"), program.as_os_str(), option, value];
    let mut qemu = Qemu::start(machine, &arguments)?;
    let (registers, _) = qemu.registers_and_count()?;
    qemu.gdb.resume(&registers, &registers)?;
    let mut events = Vec::new();
    while qemu.gdb.wait_for_system_call()? {
        let (seen, executed) = qemu.finish_system_call(WRITTEN)?;
        let Some(mark) = Mark::numbered(seen.r[MARK_REGISTER]) else { return Ok(None) };
        events.push(MarkRecord { at: executed, mark, value: seen.r[VALUE_REGISTER] });
        if !matches!(mark, Mark::Begin | Mark::End) {
            return Ok(Some(events));
        }
    }
    Ok(None)
}
