//! What scripts log. Text is made of it only when it is shown.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::context::ProgramId;

/// A line that a script has logged, or printed with a function of its robot.
#[derive(Debug, Clone, PartialEq)]
pub struct LogLine {
    /// When.
    pub tick: u64,
    /// The program whose constants the line has.
    pub program: ProgramId,
    /// Values, which follow each other without a gap.
    pub pieces: Vec<Piece>,
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
    /// A table with so many entries.
    Table(usize),
    /// A function.
    Function,
}

/// A flag of a run, which a robot raises when it logs a line. In most ticks no robot does, and then the logs need not be searched.
#[derive(Debug, Clone, Default)]
pub struct News(Arc<AtomicBool>);

impl News {
    /// Reports that a robot has logged something.
    pub fn note(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Returns true if a robot has raised it since the last call.
    pub fn take(&self) -> bool {
        self.0.swap(false, Ordering::Relaxed)
    }

    /// Returns the flag of a copy of the run, in the same state.
    pub fn copy(&self) -> Self {
        News(Arc::new(AtomicBool::new(self.0.load(Ordering::Relaxed))))
    }
}
