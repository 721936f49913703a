//! The log of scripts. It becomes text only when it is shown.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use bittybuzz_compiler::symbols::Symbols;
use bittybuzz_vm_core::builtin;
use bittybuzz_vm_core::number::{format_float, format_int};

use super::program::ProgramId;

/// A line that a script logged, or printed with a function of its robot.
#[derive(Debug, Clone, PartialEq)]
pub struct LogLine {
    /// The tick of the world.
    pub tick: u64,
    /// The program that defines the constants of the line.
    pub program: ProgramId,
    /// Values, which are printed without separators.
    pub pieces: Vec<Piece>,
    pub kind: LineKind,
}

/// The origin of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LineKind {
    /// The script or a function of the robot.
    Logged,
    /// The answer to a question.
    Answer,
    /// A question that has no answer, with the reason.
    NoAnswer,
    /// A question that an error has ended: the last fault of the robot.
    Fault,
}

/// A value that was logged.
#[derive(Debug, Clone, PartialEq)]
pub enum Piece {
    /// nil
    Nil,
    /// An integer.
    Int(i32),
    /// A float.
    Float(f32),
    /// A constant string of the script, by its number.
    Constant(u16),
    /// The bytes of a string that was made at run time.
    Text(Vec<u8>),
    /// A table, by its number of entries.
    Table(usize),
    /// A function.
    Function,
}

impl Piece {
    /// Appends the text that `log` prints for the value. Without the symbols of the script, its
    /// constants are shown as numbers.
    pub fn append_to(&self, symbols: Option<&Symbols>, text: &mut Vec<u8>) {
        match self {
            Piece::Nil => text.extend(b"[nil]"),
            Piece::Int(value) => format_int(*value, &mut |byte| text.push(byte)),
            Piece::Float(value) => format_float(*value, &mut |byte| text.push(byte)),
            Piece::Constant(number) => {
                let known = match symbols {
                    Some(symbols) => symbols.string(*number),
                    None => builtin::STRINGS.get(usize::from(*number)).copied(),
                };
                match known {
                    Some(known) => text.extend(known.bytes()),
                    None => text.extend(unknown_string(*number)),
                }
            }
            Piece::Text(bytes) => text.extend(bytes),
            Piece::Table(size) => text.extend(format!("[table with {size} elems]").bytes()),
            Piece::Function => text.extend(b"[closure]"),
        }
    }
}

/// Returns a stand-in for a constant string whose text is not known.
#[must_use]
pub(super) fn unknown_string(number: u16) -> Vec<u8> {
    format!("[string {number}]").into_bytes()
}

/// A flag of a run, which a robot raises when it logs a line. Most ticks have no new line, and the
/// logs need not be searched.
#[derive(Debug, Clone, Default)]
pub struct News(Arc<AtomicBool>);

impl News {
    /// Reports that a robot has logged something.
    pub fn note(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Lowers the flag. Returns true if a robot has raised it since the last call.
    pub fn take(&self) -> bool {
        self.0.swap(false, Ordering::Relaxed)
    }

    /// Returns the flag of a copy of the run, in the same state.
    pub fn copy(&self) -> Self {
        News(Arc::new(AtomicBool::new(self.0.load(Ordering::Relaxed))))
    }
}
