//! A run-time error of a script in words: the message, the place with its source line, the values
//! that the instruction used, the calls that led there, and the help.
//!
//! The machine reports a cause, the types of the operands and a position. The instruction at that
//! position gives the operation, and the symbols give the place; together they make a sentence
//! about the script. A terminal prints a [`FaultReport`] as a message with the source line,
//! programs read its JSON, and a page shows its [`FaultDescription`].
//!
//! # Principles
//! 1. **One writer.** `bbz run`, `bbz sim`, `bbz trace`, their `--json` and the page get the same
//!    words from here.
//! 2. **What is unknown is left out.** Without symbols there is a position instead of a place,
//!    without the source text no source line, without the machine no values.
//!
//! # Features
//! * `declarations` declares [`FaultDescription`] for scripts of pages. It costs nothing in a
//!   program, because only a test uses it.
//!
//! # What it will not do
//! Read files ([`SourceTexts`] does), print, or depend on a robot.

mod backtrace;
mod code;
mod description;
mod instruction;
mod memory;
mod operand;
mod program;
mod report;
mod values;
mod words;

pub use backtrace::Backtrace;
pub use code::{code, title};
pub use description::{FaultDescription, FaultPlace, FaultValue};
pub use program::{KnownProgram, SourceTexts};
pub use report::FaultReport;
pub use words::accepted;

/// Replaces control characters, because text from scripts and symbols must not control the
/// terminal. The renderer does this for titles and source lines, but not for other text.
pub fn printable(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect()
}
