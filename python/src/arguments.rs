//! Arguments of calls, with a clear sentence about a wrong one.

use std::ops::RangeInclusive;
use std::path::PathBuf;

use bittybuzz_robot_spec::Robot;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyInt, PyString};

use crate::diagnostic::{Diagnostic, text_of};
use crate::error::{RobotError, with_diagnostics};

/// The most threads of a simulation.
pub const THREADS_MAX: i64 = 1024;

/// Returns an integer, also one of NumPy.
pub fn integer(name: &str, value: &Bound<'_, PyAny>, range: RangeInclusive<i64>) -> PyResult<i64> {
    let (first, last) = (range.start(), range.end());
    // An object with `__index__` is an integer to Python, as NumPy's integers are.
    let Ok(index) = value.call_method0("__index__") else {
        let kind = value.get_type().name()?;
        let text = format!("`{name}` must be an integer from {first} to {last}, not a {kind}");
        return Err(PyTypeError::new_err(text));
    };
    let shown = index.cast::<PyInt>()?;
    // Larger numbers than those of 64 bits are out of every range.
    match shown.extract::<i64>() {
        Ok(number) if range.contains(&number) => Ok(number),
        _ => {
            let text = format!("`{name}` must be an integer from {first} to {last}, not {shown}");
            Err(PyValueError::new_err(text))
        }
    }
}

/// A script: its text, or the path of its file.
pub enum Source {
    Text(String),
    Path(PathBuf),
}

impl Source {
    /// A string that ends in `.bzz` and has one line is a path, as everything that `os.fspath`
    /// accepts; other strings are texts.
    pub fn new(value: &Bound<'_, PyAny>) -> PyResult<Self> {
        if let Ok(text) = value.cast::<PyString>() {
            let text = text.to_string_lossy().into_owned();
            let is_path = text.ends_with(".bzz") && !text.contains('\n');
            return Ok(if is_path { Source::Path(text.into()) } else { Source::Text(text) });
        }
        path("source", value).map(Source::Path)
    }
}

/// Returns a path.
pub fn path(name: &str, value: &Bound<'_, PyAny>) -> PyResult<PathBuf> {
    value.extract::<PathBuf>().map_err(|_| {
        let kind = value.get_type().name();
        let kind = kind.map_or_else(|_| "object".to_owned(), |kind| kind.to_string());
        PyTypeError::new_err(format!("`{name}` must be a string or a path, not a {kind}"))
    })
}

/// Returns the robot of that name, or that of the robot file at that path.
pub fn robot(value: Option<&Bound<'_, PyAny>>) -> PyResult<Option<Robot>> {
    let Some(value) = value else { return Ok(None) };
    let name = path("robot", value)?;
    let found = bittybuzz_robot_files::find(&name.to_string_lossy());
    found.map(Some).map_err(|errors| {
        let diagnostics: Vec<Diagnostic> = errors.0.iter().map(of_robot_file).collect();
        let error = RobotError::new_err(text_of(&diagnostics));
        with_diagnostics(value.py(), error, diagnostics)
    })
}

fn of_robot_file(error: &bittybuzz_robot_spec::RobotError) -> Diagnostic {
    let place = error.place.as_deref();
    Diagnostic {
        severity: "error",
        code: None,
        message: error.to_string(),
        label: None,
        help: error.help(),
        file: place.map(|place| place.path.clone()),
        line: place.map(|place| place.line),
        column: place.map(|place| place.column),
        end_line: place.map(|place| place.line),
        end_column: place.map(|place| place.column + place.width),
    }
}
