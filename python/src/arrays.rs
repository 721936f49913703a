//! NumPy arrays. NumPy is imported by the first call that needs it.

use numpy::IntoPyArray;
use numpy::ndarray::{Array1, Array2};
use numpy::{Element, PyArray1, PyArray2};
use pyo3::exceptions::PyImportError;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyModule;

/// NumPy, once it was imported.
static NUMPY: PyOnceLock<Py<PyModule>> = PyOnceLock::new();

/// Imports NumPy. The crate `numpy` would panic without it.
pub fn numpy(py: Python<'_>) -> PyResult<&Bound<'_, PyModule>> {
    let import = || PyModule::import(py, "numpy").map(Bound::unbind);
    let module = NUMPY.get_or_try_init(py, import).map_err(|error| {
        let help = PyImportError::new_err("arrays need NumPy: `pip install numpy`");
        help.set_cause(py, Some(error));
        help
    })?;
    Ok(module.bind(py))
}

/// Moves numbers into an array of shape (N,).
pub fn array_1<T: Element>(py: Python<'_>, numbers: Vec<T>) -> PyResult<Bound<'_, PyArray1<T>>> {
    numpy(py)?;
    Ok(Array1::from_vec(numbers).into_pyarray(py))
}

/// Moves rows of `COLUMNS` numbers into an array of shape (N, COLUMNS).
pub fn array_2<const COLUMNS: usize>(
    py: Python<'_>,
    rows: Vec<[f32; COLUMNS]>,
) -> PyResult<Bound<'_, PyArray2<f32>>> {
    numpy(py)?;
    let shape = (rows.len(), COLUMNS);
    let rows = Array2::from_shape_vec(shape, rows.into_flattened());
    Ok(rows.expect("the shape is that of the rows").into_pyarray(py))
}

/// Moves numbers into an array of shape (T, `columns`), row by row.
pub fn table(
    py: Python<'_>,
    columns: usize,
    numbers: Vec<f64>,
) -> PyResult<Bound<'_, PyArray2<f64>>> {
    numpy(py)?;
    let rows = numbers.len().checked_div(columns).unwrap_or(0);
    let table = Array2::from_shape_vec((rows, columns), numbers);
    Ok(table.expect("each row has as many numbers as columns").into_pyarray(py))
}
