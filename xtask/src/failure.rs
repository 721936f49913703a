//! Why a task stopped.

use crate::bench::BenchError;
use bittybuzz_vm_core::Part;
use std::fmt;
use std::io;
use std::path::PathBuf;
use std::process::ExitStatus;

/// Why a task stopped.
#[derive(Debug)]
pub enum Failure {
    /// The command line asks for something that does not exist.
    Usage(String),
    /// A program could not be started.
    Start { program: String, reason: io::Error },
    /// A program ended with a status that was not expected.
    Status { command: String, status: ExitStatus },
    /// A file or folder could not be read.
    Read { path: PathBuf, reason: io::Error },
    /// A file or folder could not be written.
    Write { path: PathBuf, reason: io::Error },
    /// There is nothing to run in this folder.
    Empty { folder: PathBuf },
    /// Packages of the system are missing, and only the user can install them.
    Packages { command: String },
    /// A robot file that cannot be used for this.
    Robot(String),
    /// A linked program that cannot be understood.
    Elf { path: PathBuf, reason: String },
    /// An image needs more memory than its robot file allows.
    OverBudget(Vec<String>),
    /// A script needs more of the machine than the flash of its robot holds.
    TooLarge {
        script: PathBuf,
        /// Bytes of flash that are missing.
        excess: u64,
        /// What each part takes that could be left out.
        costs: Vec<(u64, Part)>,
    },
    /// The initial value of the machine takes flash.
    NotZero { robot: &'static str },
    /// Benchmarks cannot be counted, or cost more than before.
    Bench(BenchError),
    /// The emulated robot did not log what this computer logs.
    LogsDiffer { script: String },
    /// A mutant's text is not in its file exactly once.
    MutantText { mutant: &'static str, file: &'static str, count: usize },
    /// The tests fail although nothing was changed.
    Unchanged { failed: Vec<String> },
    /// Some of the evidence is missing.
    Soak { left: Vec<String> },
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Failure::Usage(message) => f.write_str(message),
            Failure::Start { program, reason } => write!(f, "cannot start `{program}`: {reason}"),
            Failure::Status { command, status } => write!(f, "`{command}` ended with {status}"),
            Failure::Read { path, reason } => write!(f, "cannot read {}: {reason}", path.display()),
            Failure::Write { path, reason } => {
                write!(f, "cannot write {}: {reason}", path.display())
            }
            Failure::Empty { folder } => write!(f, "no scripts in {}", folder.display()),
            Failure::Packages { command } => {
                write!(f, "packages are missing; please run: {command}")
            }
            Failure::Robot(message) => f.write_str(message),
            Failure::Elf { path, reason } => write!(f, "{}: {reason}", path.display()),
            Failure::OverBudget(excesses) => {
                write!(f, "over what the robot file allows: {}", excesses.join(", "))
            }
            Failure::TooLarge { script, excess, costs } => {
                write!(
                    f,
                    "{} needs {excess} bytes of flash more than there are; so much is saved by a script that does without",
                    script.display()
                )?;
                costs
                    .iter()
                    .try_for_each(|(bytes, part)| write!(f, "\n{bytes:7} bytes: {}", part.what()))
            }
            Failure::NotZero { robot } => {
                write!(f, "{robot}: the machine is not all zeros before an image is loaded")
            }
            Failure::Bench(error) => error.fmt(f),
            Failure::LogsDiffer { script } => {
                write!(f, "the emulated robot logs something else than `bbz run {script}`")
            }
            Failure::MutantText { mutant, file, count } => write!(
                f,
                "mutant {mutant}: its text is in {file} {count} times, not once; bring xtask/src/soak/table.rs up to date"
            ),
            Failure::Unchanged { failed } => {
                write!(f, "without any mutation these tests fail: {}", failed.join(", "))
            }
            Failure::Soak { left } => write!(f, "not shown: {}", left.join(", ")),
        }
    }
}
