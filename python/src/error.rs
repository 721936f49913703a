//! Exceptions, and the border between Python and Rust.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};

use bittybuzz_arena::scenario::ScenarioError as ScenarioMistake;
use bittybuzz_live::CompilerMessage;
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use crate::diagnostic::{Diagnostic, text_of};

pyo3::import_exception!(bittybuzz._errors, Busy);
pyo3::import_exception!(bittybuzz._errors, Defect);
pyo3::import_exception!(bittybuzz._errors, Error);
pyo3::import_exception!(bittybuzz._errors, NotReplayable);
pyo3::import_exception!(bittybuzz._errors, RobotError);
pyo3::import_exception!(bittybuzz._errors, RunError);
pyo3::import_exception!(bittybuzz._errors, ScenarioError);
pyo3::import_exception!(bittybuzz._errors, ScriptError);

/// Calls a function for Python. A panic becomes the exception `Defect`.
pub fn border<T>(act: impl FnOnce() -> PyResult<T>) -> PyResult<T> {
    catch_unwind(AssertUnwindSafe(act)).unwrap_or_else(|panic| {
        Err(Defect::new_err(format!("{}; please report it", message_of(&*panic))))
    })
}

/// Returns the message of a panic.
fn message_of(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    let text = text.or_else(|| panic.downcast_ref::<&str>().copied());
    text.unwrap_or("a panic without a message").to_owned()
}

/// Sets the attribute `diagnostics` of an exception.
pub fn with_diagnostics(py: Python<'_>, error: PyErr, diagnostics: Vec<Diagnostic>) -> PyErr {
    let set =
        PyTuple::new(py, diagnostics).and_then(|list| error.value(py).setattr("diagnostics", list));
    set.err().unwrap_or(error)
}

/// Returns the exception for mistakes in a scenario or in its scripts: `ScriptError` if one of them
/// is a message of the compiler, which has a code.
pub fn of_messages(py: Python<'_>, messages: Vec<CompilerMessage>) -> PyErr {
    let is_of_script = messages.iter().any(|message| message.code.is_some());
    let diagnostics: Vec<Diagnostic> = messages.into_iter().map(Diagnostic::from).collect();
    let text = text_of(&diagnostics);
    let error = match is_of_script {
        true => ScriptError::new_err(text),
        false => ScenarioError::new_err(text),
    };
    with_diagnostics(py, error, diagnostics)
}

/// Returns the exception for mistakes in a scenario or a command.
pub fn of_scenario(py: Python<'_>, mistakes: &[ScenarioMistake]) -> PyErr {
    of_messages(py, mistakes.iter().map(CompilerMessage::of_scenario).collect())
}
