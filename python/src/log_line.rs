//! Log lines of scripts.

use bittybuzz_arena::robot;
use bittybuzz_arena::run::{Setup, TICKS_PER_SECOND};
use pyo3::prelude::*;

/// A line that a script logged.
#[pyclass(frozen, get_all, eq, module = "bittybuzz")]
#[derive(Debug, Clone, PartialEq)]
pub struct LogLine {
    pub time: f64,
    pub robot: u16,
    pub text: String,
}

impl LogLine {
    /// Returns the line of the robot with a number.
    pub fn new(setup: &Setup, number: usize, line: &robot::LogLine) -> Self {
        let symbols = setup.program(line.program).and_then(|program| program.symbols.as_deref());
        let mut text = Vec::new();
        line.pieces.iter().for_each(|piece| piece.append_to(symbols, &mut text));
        LogLine {
            time: line.tick as f64 / TICKS_PER_SECOND,
            robot: setup.id(number),
            text: String::from_utf8_lossy(&text).into_owned(),
        }
    }
}

#[pymethods]
impl LogLine {
    fn __str__(&self) -> String {
        format!("{:.1} {} {}", self.time, self.robot, self.text)
    }

    fn __repr__(&self) -> String {
        format!("<LogLine {}>", self.__str__())
    }
}
