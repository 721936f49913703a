//! Values of Python as TOML, the language of scenarios and commands.

use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyString, PyTuple};

/// The deepest list in a list. A list can contain itself.
const DEPTH_MAX: usize = 8;

/// Returns the settings `KEY=VALUE` of a dictionary, as `--set` has them.
pub fn settings(set: Option<&Bound<'_, PyDict>>) -> PyResult<Vec<String>> {
    let pairs = set.into_iter().flat_map(|set| set.iter());
    let setting = |(key, value): (Bound<'_, PyAny>, Bound<'_, PyAny>)| {
        let Ok(key) = key.cast::<PyString>() else {
            return Err(PyTypeError::new_err("the keys of `set` must be strings"));
        };
        let key = key.to_string_lossy();
        if key.contains('=') || key.trim().is_empty() {
            let text = format!("`{key}` is no key of a scenario, such as \"medium.ir.loss\"");
            return Err(PyValueError::new_err(text));
        }
        Ok(format!("{key}={}", value_text(&key, &value, 0)?))
    };
    pairs.map(setting).collect()
}

/// Returns a value as TOML.
fn value_text(key: &str, value: &Bound<'_, PyAny>, depth: usize) -> PyResult<String> {
    if depth > DEPTH_MAX {
        let text = format!("the value of `{key}` has more than {DEPTH_MAX} lists in each other");
        return Err(PyValueError::new_err(text));
    }
    // A bool is an integer to Python, but not to TOML.
    if let Ok(truth) = value.cast::<PyBool>() {
        return Ok(truth.is_true().to_string());
    }
    if value.is_instance_of::<PyInt>() {
        return Ok(value.str()?.to_string_lossy().into_owned());
    }
    if let Ok(number) = value.cast::<PyFloat>() {
        return Ok(float(number.value()));
    }
    if let Ok(text) = value.cast::<PyString>() {
        return Ok(string(&text.to_string_lossy()));
    }
    if value.is_instance_of::<PyList>() || value.is_instance_of::<PyTuple>() {
        let items = value.try_iter()?;
        let items = items.map(|item| value_text(key, &item?, depth + 1));
        return Ok(format!("[{}]", items.collect::<PyResult<Vec<String>>>()?.join(", ")));
    }
    // Arrays and scalars of NumPy.
    if let Ok(items) = value.call_method0("tolist") {
        return value_text(key, &items, depth + 1);
    }
    let kind = value.get_type().name()?;
    let text = format!(
        "the value of `{key}` must be a number, a truth value, a string or a list, not a {kind}"
    );
    Err(PyTypeError::new_err(text))
}

/// Returns a float with all its digits.
pub fn float(number: f64) -> String {
    if number.is_nan() { "nan".to_owned() } else { format!("{number:?}") }
}

/// Returns a string of one line.
pub fn string(text: &str) -> String {
    let mut quoted = String::from("\"");
    for c in text.chars() {
        match c {
            '\\' | '"' => quoted.extend(['\\', c]),
            _ if c.is_control() => quoted += &format!("\\u{:04X}", u32::from(c)),
            _ => quoted.push(c),
        }
    }
    quoted + "\""
}
