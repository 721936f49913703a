//! Scripts: the compiler.

use std::path::{Path, PathBuf};

use bittybuzz_compiler::compile::{self as compiler, Compiled, Options};
use bittybuzz_compiler::include::{DiskFiles, IncludeLoader};
use bittybuzz_compiler::parser::parse_file;
use bittybuzz_compiler::render::Renderer;
use bittybuzz_compiler::symbols::Symbols;
use bittybuzz_live::{CompilerMessage, environment_folders};
use bittybuzz_robot_files::all_shipped;
use bittybuzz_robot_spec::Robot;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::arguments::{Source, robot};
use crate::diagnostic::{Diagnostic, text_of};
use crate::error::{ScriptError, border, with_diagnostics};

/// The name of a text that is in no file, for messages.
const TEXT: &str = "<text>";

/// A compiled script.
#[pyclass(frozen, module = "bittybuzz")]
pub struct Script {
    image: Vec<u8>,
    symbols: Symbols,
    diagnostics: Vec<Diagnostic>,
}

#[pymethods]
impl Script {
    /// The image (`.bbi`), which robots run.
    #[getter]
    fn image<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, &self.image)
    }

    /// The content of the symbols (`.sym`): names of globals, strings, places of the code.
    #[getter]
    fn symbols<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let json = PyModule::import(py, "json")?;
        json.call_method1("loads", (self.symbols.to_json(),))
    }

    /// The warnings of the compiler.
    #[getter]
    fn diagnostics(&self) -> Vec<Diagnostic> {
        self.diagnostics.clone()
    }

    /// The number profile: "tiny" (16 bits) or "full" (32 bits).
    #[getter]
    fn profile(&self) -> &str {
        &self.symbols.profile
    }

    /// The hash of the script, which its messages carry.
    #[getter]
    fn hash(&self) -> u32 {
        self.symbols.script_hash
    }

    fn __repr__(&self) -> String {
        format!("<Script {:08x}, {} bytes>", self.symbols.script_hash, self.image.len())
    }
}

/// Compiles a script for a robot, or for all robots.
pub fn compiled(source: &Source, robot: Option<Robot>, include: Vec<PathBuf>) -> Compiled {
    let options = Options { robot, robots: all_shipped(), ..Options::default() };
    let loader = IncludeLoader {
        folders: include,
        environment: environment_folders(),
        library: bittybuzz_library::FILES,
        ..IncludeLoader::new(&DiskFiles)
    };
    match source {
        Source::Path(path) => compiler::compile_parsed(parse_file(path, &loader), &options),
        Source::Text(text) => compiler::compile(Path::new(TEXT), text.clone(), &loader, &options),
    }
}

/// Returns the messages of the compiler.
pub fn diagnostics(compiled: &Compiled) -> Vec<Diagnostic> {
    let renderer = Renderer::new(&compiled.sources);
    let all = compiled.diagnostics.iter();
    all.map(|one| CompilerMessage::of_diagnostic(&renderer, one).into()).collect()
}

/// Returns the exception for a script with mistakes.
pub fn refused(py: Python<'_>, diagnostics: Vec<Diagnostic>) -> PyErr {
    let errors: Vec<Diagnostic> =
        diagnostics.iter().filter(|one| one.severity == "error").cloned().collect();
    with_diagnostics(py, ScriptError::new_err(text_of(&errors)), diagnostics)
}

/// Compiles a script: a text, or the path of a file that ends in `.bzz`.
///
/// `robot` is the name of a robot or the path of a robot file; without one, the script may call the
/// functions of all shipped robots, in the profile "full". Included files are searched next to the
/// including file, in the folders `include`, and in the library.
#[pyfunction]
#[pyo3(signature = (source, *, robot = None, include = Vec::new()))]
pub fn compile(
    py: Python<'_>,
    source: &Bound<'_, PyAny>,
    robot: Option<&Bound<'_, PyAny>>,
    include: Vec<PathBuf>,
) -> PyResult<Script> {
    let (source, robot) = (Source::new(source)?, self::robot(robot)?);
    border(|| {
        let compiled = py.detach(|| compiled(&source, robot, include));
        let diagnostics = diagnostics(&compiled);
        match (compiled.image, compiled.symbols) {
            (Some(image), Some(symbols)) => Ok(Script { image, symbols, diagnostics }),
            _ => Err(refused(py, diagnostics)),
        }
    })
}

/// Returns the errors and warnings of the compiler about a script.
#[pyfunction]
#[pyo3(signature = (source, *, robot = None, include = Vec::new()))]
pub fn check(
    py: Python<'_>,
    source: &Bound<'_, PyAny>,
    robot: Option<&Bound<'_, PyAny>>,
    include: Vec<PathBuf>,
) -> PyResult<Vec<Diagnostic>> {
    let (source, robot) = (Source::new(source)?, self::robot(robot)?);
    border(|| Ok(diagnostics(&py.detach(|| compiled(&source, robot, include)))))
}
