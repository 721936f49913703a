//! The tool `bbz` in this library.

use std::ffi::OsString;

use bbz_tool::Launch;
use pyo3::prelude::*;

/// Runs the tool `bbz` with these arguments, once per process. Returns its exit status.
///
/// `program` is the words that started it, for messages that repeat a command. The interpreter's
/// handler of Ctrl-C must have been removed, as `python -m bittybuzz` does.
#[pyfunction]
pub fn main(py: Python<'_>, program: Vec<OsString>, arguments: Vec<OsString>) -> u8 {
    // Robots' emulators are separate programs, which PATH has.
    py.detach(|| bbz_tool::main(Launch { program, arguments, emulators: None }))
}
