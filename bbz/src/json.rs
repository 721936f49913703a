//! Results for programs that read them.

use bittybuzz_compiler::diagnostic::Diagnostic;
use bittybuzz_compiler::render::Renderer;
use bittybuzz_compiler::source::SourceMap;
use serde_json::{Value, json};

/// Returns an object for each message about a script.
pub fn diagnostics(sources: &SourceMap, diagnostics: &[Diagnostic]) -> Vec<Value> {
    let renderer = Renderer::new(sources);
    diagnostics.iter().map(|diagnostic| renderer.json(diagnostic)).collect()
}

/// Returns one object with all messages and the numbers of errors and warnings.
pub fn messages(diagnostics: &[Value], errors: usize, warnings: usize) -> Value {
    json!({ "errors": errors, "warnings": warnings, "diagnostics": diagnostics })
}
