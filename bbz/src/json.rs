//! Results for programs that read them.

use bittybuzz_compiler::diagnostic::Diagnostic;
use bittybuzz_compiler::render::Renderer;
use bittybuzz_compiler::source::SourceMap;
use serde_json::{Value, json};

use crate::report;

/// What the compiler says about a script.
pub fn diagnostics(sources: &SourceMap, diagnostics: &[Diagnostic]) -> Value {
    let renderer = Renderer::new(sources);
    let objects: Vec<Value> = diagnostics
        .iter()
        // The renderer writes an object; were it none, its text would still be told.
        .map(|diagnostic| renderer.json(diagnostic))
        .map(|text| serde_json::from_str(&text).unwrap_or(Value::String(text)))
        .collect();
    let (errors, warnings) = report::count(diagnostics);
    json!({ "errors": errors, "warnings": warnings, "diagnostics": objects })
}
