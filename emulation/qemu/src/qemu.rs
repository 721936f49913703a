//! The QEMU process: started with the machine that has an STM32F405, and what of it must be asked.
//!
//! Its two ports are socket pairs in place of its standard input and output: no names in the file system,
//! nothing to wait for, and they break when QEMU ends.

use std::io::{self, Read};
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::process::{Child, Command, Stdio};
use std::thread::JoinHandle;

use crate::gdb::{Gdb, GdbError};
use crate::qtest::{Qtest, QtestError};

const PROGRAM: &str = "qemu-system-arm";
/// Replaces itself by the program it starts, which is then killed when this process dies, even if this is
/// killed; QEMU would not notice.
const STARTER: &str = "setpriv";
const STARTER_ARGUMENTS: [&str; 2] = ["--pdeathsig", "KILL"];
/// An instruction takes 2^0 ns of QEMU's clock. While it records, QEMU also tells how many instructions were
/// executed; the clock alone does not, for it jumps to the next timer whenever the core is stopped.
const ICOUNT: &str = "shift=0,sleep=off,rr=record,rrfile=/dev/null";
/// The machine's board; all that matters is its STM32F405.
const MACHINE: &str = "netduinoplus2";
const CHIP_TYPE: &str = "(child<stm32f405-soc>)";
/// Where a machine's objects stand in QEMU's object model: under it, or here if it gave them no name.
const MACHINE_PATHS: [&str; 2] = ["/machine", "/machine/unattached"];

/// A running QEMU, its core stopped.
pub struct Qemu {
    process: Process,
    /// The debugger port.
    pub gdb: Gdb,
    /// The test port.
    pub qtest: Qtest,
    /// Path of the core with its interrupt controller in QEMU's object model.
    pub core: String,
}

/// Why QEMU cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum QemuError {
    /// It is not installed.
    #[error("{PROGRAM} was not found: install the package qemu-system-arm")]
    NotInstalled,
    /// It could not be started.
    #[error("cannot start {PROGRAM}: {0}")]
    Start(#[from] io::Error),
    /// What starts it is not installed.
    #[error("{STARTER} was not found: install the package util-linux")]
    NoStarter,
    /// It has no STM32F405.
    #[error("the machine {MACHINE} of this {PROGRAM} has no STM32F405: use version 7.2 or later")]
    NoChip,
    /// The debugger port.
    #[error(transparent)]
    Gdb(#[from] GdbError),
    /// The test port.
    #[error(transparent)]
    Qtest(#[from] QtestError),
}

impl Qemu {
    /// Starts QEMU with empty memory.
    pub fn start() -> Result<Self, QemuError> {
        let (gdb, gdb_end) = UnixStream::pair()?;
        let (qtest, qtest_end) = UnixStream::pair()?;
        let process = Process::start(gdb_end, qtest_end)?;
        let mut gdb = Gdb::new(gdb)?;
        let chip = find_chip(&mut gdb)?;
        Ok(Qemu { process, gdb, qtest: Qtest::new(qtest), core: format!("{chip}/armv7m") })
    }

    /// Waits until QEMU has ended, after its ports broke, and returns what it printed.
    pub fn last_words(self) -> String {
        self.process.last_words()
    }
}

fn find_chip(gdb: &mut Gdb) -> Result<String, QemuError> {
    for path in MACHINE_PATHS {
        let children = gdb.monitor(&format!("qom-list {path}"))?;
        if let Some(line) = children.lines().find(|line| line.contains(CHIP_TYPE)) {
            let name = line.split_whitespace().next().unwrap_or_default();
            return Ok(format!("{path}/{name}"));
        }
    }
    Err(QemuError::NoChip)
}

/// The process, ended with its owner.
struct Process {
    child: Child,
    messages: Option<JoinHandle<String>>,
}

impl Process {
    fn start(gdb: UnixStream, qtest: UnixStream) -> Result<Self, QemuError> {
        // Only to tell whether it is there: below, it is started by another program.
        Command::new(PROGRAM).arg("--version").output().map_err(|error| match error.kind() {
            io::ErrorKind::NotFound => QemuError::NotInstalled,
            _ => QemuError::Start(error),
        })?;
        let mut child = Command::new(STARTER)
            .args(STARTER_ARGUMENTS)
            .arg(PROGRAM)
            .args(["-machine", MACHINE, "-nodefaults", "-display", "none", "-S"])
            .args(["-accel", "tcg", "-icount", ICOUNT])
            .args(["-chardev", "socket,id=gdb,fd=0", "-gdb", "chardev:gdb"])
            // As an object, because what comes to the option `-qtest` is recorded, and waits while the core is
            // stopped.
            .args(["-chardev", "socket,id=qtest,fd=1"])
            .args(["-object", "qtest,id=port,chardev=qtest,log=/dev/null"])
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
                // What came before an error is all there is to show.
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
        // Both fail only if it has ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
