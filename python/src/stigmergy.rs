//! The stigmergies that a robot knows, as dictionaries.

use bittybuzz_arena::run::Simulation as Run;
use bittybuzz_inspect::{Limits, ScriptValue};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Nothing inside of tables is read.
const LIMITS: Limits = Limits { depth: 0, values: 0 };

/// Returns a dictionary for each stigmergy that a robot's script has created, by its number.
/// Returns an empty one for a robot that has not joined.
pub fn of_robot<'py>(py: Python<'py>, run: &Run, number: usize) -> PyResult<Bound<'py, PyDict>> {
    let all = PyDict::new(py);
    let Some(inspection) = run.inspect(number, LIMITS) else { return Ok(all) };
    for stigmergy in inspection.stigmergies {
        let entries = PyDict::new(py);
        for entry in &stigmergy.entries {
            entries.set_item(object(py, &entry.key)?, object(py, &entry.value)?)?;
        }
        all.set_item(stigmergy.number, entries)?;
    }
    Ok(all)
}

/// Returns a number, a string or `None`; the other values are described by a text.
fn object<'py>(py: Python<'py>, value: &ScriptValue) -> PyResult<Bound<'py, PyAny>> {
    Ok(match value {
        ScriptValue::Nil | ScriptValue::Unset => py.None().into_bound(py),
        ScriptValue::Int(number) => number.into_pyobject(py)?.into_any(),
        ScriptValue::Float(number) => number.into_pyobject(py)?.into_any(),
        ScriptValue::String(text) => text.into_pyobject(py)?.into_any(),
        ScriptValue::UnknownString(number) => text_of(py, &format!("[string {number}]"))?,
        ScriptValue::Table(_) => text_of(py, "[table]")?,
        ScriptValue::Closure(_) => text_of(py, "[closure]")?,
        ScriptValue::Function(name)
        | ScriptValue::Builtin(name)
        | ScriptValue::RobotFunction(name) => text_of(py, &format!("[function {name}]"))?,
        ScriptValue::Library(name) => text_of(py, &format!("[library {name}]"))?,
        ScriptValue::Swarm(number) => text_of(py, &format!("[swarm {number}]"))?,
        ScriptValue::Stigmergy(number) => text_of(py, &format!("[stigmergy {number}]"))?,
    })
}

fn text_of<'py>(py: Python<'py>, text: &str) -> PyResult<Bound<'py, PyAny>> {
    Ok(text.into_pyobject(py)?.into_any())
}
