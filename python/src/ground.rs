//! Ground of the caller, which ground sensors read.

use std::fmt;
use std::sync::{Arc, PoisonError};

use bittybuzz_arena::engine::Environment;
use numpy::{PyArray1, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arrays::{array_2, numpy};
use crate::state::Failure;

/// The brightness where no call has given one.
const WHITE: f32 = 1.0;

/// A callback that returns the brightness at places.
pub struct PythonGround {
    callback: Arc<Py<PyAny>>,
    /// Receives an exception of the callback. The world cannot stop in a tick, so the step that made
    /// the tick raises it.
    failure: Failure,
    /// The values of the last call, which stand in for those of a call that fails.
    last: Vec<f32>,
}

impl fmt::Debug for PythonGround {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // A digest is computed from this text: the values that robots have read are a part of the
        // robots' state.
        f.write_str("PythonGround")
    }
}

impl PythonGround {
    pub fn new(callback: Py<PyAny>, failure: Failure) -> Self {
        PythonGround { callback: Arc::new(callback), failure, last: Vec::new() }
    }
}

impl Environment for PythonGround {
    fn copy(&self) -> Box<dyn Environment> {
        let (callback, failure) = (self.callback.clone(), self.failure.clone());
        Box::new(PythonGround { callback, failure, last: self.last.clone() })
    }

    fn sense(&mut self, places: &[[f32; 2]], values: &mut [f32]) {
        if places.is_empty() {
            return;
        }
        match Python::attach(|py| sensed(py, &self.callback, places)) {
            Ok(read) => self.last = read,
            Err(error) => {
                self.last.resize(places.len(), WHITE);
                *self.failure.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
            }
        }
        values.copy_from_slice(&self.last);
    }
}

/// Calls the callback, and checks its result.
fn sensed(py: Python<'_>, callback: &Py<PyAny>, places: &[[f32; 2]]) -> PyResult<Vec<f32>> {
    let result = callback.call1(py, (array_2(py, places.to_vec())?,))?;
    let floats = numpy(py)?.call_method1("ascontiguousarray", (result, "float32"))?;
    let read = floats.cast::<PyArray1<f32>>().ok().and_then(|read| read.to_vec().ok());
    let Some(read) = read.filter(|read| read.len() == places.len()) else {
        return Err(wrong(&floats, places.len())?);
    };
    if let Some(value) = read.iter().find(|value| !(0.0..=1.0).contains(*value)) {
        let text = format!("`ground` must return values from 0 (black) to 1 (white), not {value}");
        return Err(PyValueError::new_err(text));
    }
    Ok(read)
}

/// Returns the exception for an array of another shape.
fn wrong(floats: &Bound<'_, PyAny>, count: usize) -> PyResult<PyErr> {
    let shape = floats.getattr("shape")?;
    let text = format!("`ground` must return an array of shape ({count},), not of {shape}");
    Ok(PyValueError::new_err(text))
}
