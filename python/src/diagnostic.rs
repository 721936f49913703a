//! Messages about scripts and scenarios.

use std::fmt;

use bittybuzz_live::{CompilerMessage, MessageSeverity};
use pyo3::prelude::*;

/// A message about a script, a scenario or a command.
#[pyclass(frozen, get_all, eq, module = "bittybuzz")]
#[derive(Debug, Clone, PartialEq)]
pub struct Diagnostic {
    pub severity: &'static str,
    pub code: Option<String>,
    pub message: String,
    pub label: Option<String>,
    pub help: Option<String>,
    pub file: Option<String>,
    pub line: Option<usize>,
    pub column: Option<usize>,
    pub end_line: Option<usize>,
    pub end_column: Option<usize>,
}

impl From<CompilerMessage> for Diagnostic {
    fn from(message: CompilerMessage) -> Self {
        Diagnostic {
            severity: match message.severity {
                MessageSeverity::Error => "error",
                MessageSeverity::Warning => "warning",
            },
            code: message.code,
            message: message.message,
            label: message.label.filter(|label| !label.is_empty()),
            help: message.help,
            file: message.file,
            line: message.line,
            column: message.column,
            end_line: message.end_line,
            end_column: message.end_column,
        }
    }
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let (Some(file), Some(line), Some(column)) = (&self.file, self.line, self.column) {
            write!(f, "{file}:{line}:{column}: ")?;
        }
        f.write_str(self.severity)?;
        if let Some(code) = &self.code {
            write!(f, "[{code}]")?;
        }
        write!(f, ": {}", self.message)?;
        if let Some(label) = &self.label {
            write!(f, ": {label}")?;
        }
        match &self.help {
            Some(help) => write!(f, "\n  help: {help}"),
            None => Ok(()),
        }
    }
}

#[pymethods]
impl Diagnostic {
    fn __str__(&self) -> String {
        self.to_string()
    }

    fn __repr__(&self) -> String {
        format!("<Diagnostic {self}>")
    }
}

/// Returns the text of an exception: a line or two for each message.
pub fn text_of(diagnostics: &[Diagnostic]) -> String {
    let texts: Vec<String> = diagnostics.iter().map(ToString::to_string).collect();
    texts.join("\n")
}
