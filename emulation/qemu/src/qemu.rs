//! The QEMU process: starts it with one of its machines, and reads its state.
//!
//! QEMU's two ports are socket pairs in place of its standard input and output: they need no names
//! in the file system and no wait for a connection, and they break when QEMU ends.

use std::ffi::OsStr;
use std::io::{self, Read};
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::process::{Child, Command, Stdio};
use std::thread::JoinHandle;

use crate::gdb::{Gdb, GdbError};
use crate::qtest::{Qtest, QtestError};
use crate::registers::CoreRegisters;

const PROGRAM: &str = "qemu-system-arm";
/// A program that replaces itself with the program that it starts. The kernel then kills QEMU when
/// this process dies, even if this process is killed; QEMU itself would not notice.
const STARTER: &str = "setpriv";
const STARTER_ARGUMENTS: [&str; 2] = ["--pdeathsig", "KILL"];
/// An instruction takes 2^0 ns of QEMU's clock. In record mode QEMU also reports the number of
/// executed instructions. The clock alone does not give it, because it jumps to the next timer
/// whenever the core is stopped.
const ICOUNT: &str = "shift=0,sleep=off,rr=record,rrfile=/dev/null";
/// The monitor's command that prints the number of executed instructions, and the text before the
/// number.
const COUNT: &str = "info replay";
const COUNT_PREFIX: &str = "instruction count = ";
/// Paths of a machine's objects in QEMU's object model; the second is for objects without a name.
const MACHINE_PATHS: [&str; 2] = ["/machine", "/machine/unattached"];

/// A running QEMU with a stopped core.
pub struct Qemu {
    process: Process,
    /// The debugger port.
    pub gdb: Gdb,
    /// The test port.
    pub qtest: Qtest,
}

/// A reason why QEMU cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum QemuError {
    /// QEMU is not installed.
    #[error("{PROGRAM} was not found: install the package qemu-system-arm")]
    NotInstalled,
    /// QEMU could not be started.
    #[error("cannot start {PROGRAM}: {0}")]
    Start(#[from] io::Error),
    /// The program that starts QEMU is not installed.
    #[error("{STARTER} was not found: install the package util-linux")]
    NoStarter,
    /// QEMU does not report the number of executed instructions.
    #[error("QEMU does not count instructions; it printed: {printed}")]
    NoCount {
        /// The output of QEMU's monitor.
        printed: String,
    },
    /// The debugger port failed.
    #[error(transparent)]
    Gdb(#[from] GdbError),
    /// The test port failed.
    #[error(transparent)]
    Qtest(#[from] QtestError),
}

impl Qemu {
    /// Starts QEMU with this machine and further arguments.
    pub fn start(machine: &str, arguments: &[&OsStr]) -> Result<Self, QemuError> {
        let (gdb, gdb_end) = UnixStream::pair()?;
        let (qtest, qtest_end) = UnixStream::pair()?;
        let process = Process::start(machine, arguments, gdb_end, qtest_end)?;
        Ok(Qemu { process, gdb: Gdb::new(gdb)?, qtest: Qtest::new(qtest) })
    }

    /// Returns the path in QEMU's object model of the machine's object of this type.
    pub fn find(&mut self, kind: &str) -> Result<Option<String>, QemuError> {
        let kind = format!("(child<{kind}>)");
        for path in MACHINE_PATHS {
            let children = self.gdb.monitor(&format!("qom-list {path}"))?;
            if let Some(line) = children.lines().find(|line| line.contains(&kind)) {
                let name = line.split_whitespace().next().unwrap_or_default();
                return Ok(Some(format!("{path}/{name}")));
            }
        }
        Ok(None)
    }

    /// Returns the registers, and the number of instructions that the core has executed since
    /// QEMU's start.
    pub fn registers_and_count(&mut self) -> Result<(CoreRegisters, u64), QemuError> {
        let (registers, printed) = self.gdb.registers_and_monitor(COUNT)?;
        Ok((registers, executed(printed)?))
    }

    /// Returns the registers and the number of instructions at a system call, and lets the core run
    /// with `result` as the call's result.
    pub fn finish_system_call(&mut self, result: u32) -> Result<(CoreRegisters, u64), QemuError> {
        let (registers, printed) = self.gdb.finish_system_call(COUNT, result)?;
        Ok((registers, executed(printed)?))
    }

    /// Waits until QEMU has ended, after its ports broke, and returns what it printed.
    pub fn last_words(self) -> String {
        self.process.last_words()
    }
}

/// Reads the number of executed instructions in the output of QEMU's monitor.
fn executed(printed: String) -> Result<u64, QemuError> {
    let digits = printed.split_once(COUNT_PREFIX).and_then(|(_, rest)| rest.lines().next());
    let count = digits.and_then(|digits| digits.trim().parse().ok());
    count.ok_or(QemuError::NoCount { printed })
}

/// The process, which is killed when its owner is dropped.
struct Process {
    child: Child,
    messages: Option<JoinHandle<String>>,
}

impl Process {
    fn start(
        machine: &str,
        arguments: &[&OsStr],
        gdb: UnixStream,
        qtest: UnixStream,
    ) -> Result<Self, QemuError> {
        // This call only checks that QEMU is installed: below, another program starts it.
        Command::new(PROGRAM).arg("--version").output().map_err(|error| match error.kind() {
            io::ErrorKind::NotFound => QemuError::NotInstalled,
            _ => QemuError::Start(error),
        })?;
        let mut child = Command::new(STARTER)
            .args(STARTER_ARGUMENTS)
            .arg(PROGRAM)
            .args(["-machine", machine, "-nodefaults", "-display", "none", "-S"])
            .args(["-accel", "tcg", "-icount", ICOUNT])
            .args(["-chardev", "socket,id=gdb,fd=0", "-gdb", "chardev:gdb"])
            // The port is an object, because input of the option `-qtest` is recorded, and waits
            // while the core is stopped.
            .args(["-chardev", "socket,id=qtest,fd=1"])
            .args(["-object", "qtest,id=port,chardev=qtest,log=/dev/null"])
            .args(arguments)
            .stdin(OwnedFd::from(gdb))
            .stdout(OwnedFd::from(qtest))
            .stderr(Stdio::piped())
            .spawn()
            .map_err(|error| match error.kind() {
                io::ErrorKind::NotFound => QemuError::NoStarter,
                _ => QemuError::Start(error),
            })?;
        let messages = child.stderr.take().map(|mut stderr| {
            std::thread::spawn(move || {
                let mut text = Vec::new();
                // The text before an error is all that can be shown.
                let _ = stderr.read_to_end(&mut text);
                String::from_utf8_lossy(&text).into_owned()
            })
        });
        Ok(Process { child, messages })
    }

    fn last_words(mut self) -> String {
        let messages = self.messages.take().and_then(|thread| thread.join().ok());
        messages.unwrap_or_default()
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // Both calls fail only if QEMU has ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// RAM of the machine `mps2-an386`.
    const RAM: u32 = 0x2000_0000;
    /// A loop of five instructions (ARMv7-M manual, A7.7): movs r0, #3 (SYS_WRITEC); mov r1, sp;
    /// bkpt #0xab; adds r2, #1; b to the first one.
    const LOOP: [u16; 5] = [0x2003, 0x4669, 0xbeab, 0x3201, 0xe7fa];

    #[test]
    fn instructions_between_system_calls_are_counted() {
        let arguments = ["-semihosting-config", "enable=on,target=gdb"].map(OsStr::new);
        let mut qemu = Qemu::start("mps2-an386", &arguments).unwrap();
        let code: Vec<u8> = LOOP.iter().flat_map(|word| word.to_le_bytes()).collect();
        assert!(qemu.gdb.write_memory(RAM, &code).unwrap());
        let (before, _) = qemu.registers_and_count().unwrap();
        let mut first = CoreRegisters { xpsr: 1 << 24, ..CoreRegisters::default() };
        first.r[usize::from(CoreRegisters::SP)] = RAM + 0x1000;
        first.r[usize::from(CoreRegisters::PC)] = RAM;
        qemu.gdb.resume(&before, &first).unwrap();
        let mut last = None;
        for number in 0..100 {
            assert!(qemu.gdb.wait_for_system_call().unwrap());
            let (seen, count) = qemu.finish_system_call(1).unwrap();
            assert_eq!((seen.r[0], seen.r[1], seen.r[2]), (3, RAM + 0x1000, number));
            assert_eq!(count - last.unwrap_or(count - 5), 5);
            last = Some(count);
        }
    }
}
