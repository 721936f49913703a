//! The reasons why benchmarks cannot be counted, or fail.

use bittybuzz_bench::Mark;
use bittybuzz_qemu::qemu::QemuError;
use std::fmt;
use std::path::PathBuf;

/// A reason why benchmarks cannot be counted, or fail.
#[derive(Debug)]
pub enum BenchError {
    /// A program of the system is missing.
    Missing { program: &'static str },
    /// A committed table cannot be used.
    Table { path: PathBuf, reason: String },
    /// A script has errors.
    Script { path: PathBuf, messages: String },
    /// The image of a script is longer than `ROOM`.
    TooLong { name: String },
    /// A linked program does not have a symbol.
    NoSymbol { program: PathBuf, symbol: &'static str },
    /// The record of an emulator cannot be read.
    Record { what: String },
    /// QEMU has failed.
    Qemu(QemuError),
    /// The program sends no mark.
    Silent { name: String },
    /// The script ended without a result.
    NoResult { target: &'static str, name: String, mark: Mark, value: u32 },
    /// The script computes a wrong result.
    WrongResult { target: &'static str, name: String, result: String, expected: String },
    /// The cost of an instruction cannot be counted.
    Costs { name: String, reason: String },
    /// Scripts or instructions cost more than the baseline allows.
    Grown(Vec<String>),
}

impl std::error::Error for BenchError {}

impl fmt::Display for BenchError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            BenchError::Missing { program } => {
                write!(f, "`{program}` is not installed; `cargo xtask setup` installs it")
            }
            BenchError::Table { path, reason } => write!(f, "{}: {reason}", path.display()),
            BenchError::Script { path, messages } => {
                write!(f, "{} does not compile\n{messages}", path.display())
            }
            BenchError::TooLong { name } => {
                write!(f, "the image of {name} is longer than ROOM in bench/run/src/script.rs")
            }
            BenchError::NoSymbol { program, symbol } => {
                write!(f, "{} has no bytes under the symbol {symbol}", program.display())
            }
            BenchError::Record { what } => {
                write!(f, "the emulator recorded something unexpected: {what}")
            }
            BenchError::Qemu(error) => error.fmt(f),
            BenchError::Silent { name } => write!(f, "{name}: the program printed nothing"),
            BenchError::NoResult { target, name, mark, value } => {
                let why = match mark {
                    Mark::Refused => "its image is refused".to_owned(),
                    Mark::Fault => format!("fault {}", value),
                    Mark::Endless => "it does not end".to_owned(),
                    _ => "its result is no number".to_owned(),
                };
                write!(f, "{name} on {target}: {why}")
            }
            BenchError::WrongResult { target, name, result, expected } => {
                write!(f, "{name} on {target} computes {result}, not {expected}")
            }
            BenchError::Costs { name, reason } => write!(f, "the cost of {name}: {reason}"),
            BenchError::Grown(rows) => write!(
                f,
                "costs more than bench/baseline.json or bench/costs.json: {}; if that is worth it, `cargo xtask bench --update` or `bench costs --update`",
                rows.join(", ")
            ),
        }
    }
}
