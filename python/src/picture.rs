//! Drawings of simulations.

use std::fs;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arguments::path;
use crate::recording::unwritable;

/// A drawing as SVG, which notebooks display. That of a movie moves.
#[pyclass(frozen, module = "bittybuzz")]
pub struct Picture {
    /// The drawing as a document in SVG.
    #[pyo3(get)]
    svg: String,
}

impl Picture {
    pub fn new(svg: String) -> Self {
        Picture { svg }
    }
}

#[pymethods]
impl Picture {
    /// Writes the drawing to a file, whose name ends in `.svg`.
    fn save(&self, path: &Bound<'_, PyAny>) -> PyResult<()> {
        let path = self::path("path", path)?;
        if path.extension().is_none_or(|extension| extension != "svg") {
            let text = format!("`{}` does not end in .svg", path.display());
            return Err(PyValueError::new_err(text));
        }
        fs::write(&path, &self.svg).map_err(|error| unwritable(&path, &error))
    }

    /// An image, because notebooks remove elements that move from SVG of their own page.
    fn _repr_html_(&self) -> String {
        let data = STANDARD.encode(&self.svg);
        format!("<img src=\"data:image/svg+xml;base64,{data}\" style=\"max-width: 100%\">")
    }

    fn __repr__(&self) -> String {
        format!("<Picture of {} characters>", self.svg.len())
    }
}
