//! Diagnostics: the messages of the compiler to the author of a script.

use crate::codes::DiagnosticCode;
pub use crate::codes::Severity;
use crate::source::Span;

/// One message about one place.
#[derive(Debug, Clone, PartialEq)]
pub struct Diagnostic {
    pub code: DiagnosticCode,
    /// The headline: the mistake in one sentence without a full stop.
    pub message: String,
    pub span: Span,
    /// The text under the marked source; may be empty.
    pub label: String,
    /// Other places that explain this one ("first defined here").
    pub related: Vec<(Span, String)>,
    /// Advice how to correct the mistake.
    pub help: Option<String>,
    /// Changes of the source that correct the mistake, if applied together. Empty if only the
    /// author can correct it.
    pub edits: Vec<Edit>,
}

/// A change of the source.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Edit {
    /// The text that is replaced; an empty span inserts.
    pub span: Span,
    /// The replacement.
    pub text: String,
    /// True if the script can mean nothing else. `bbz check --fix` applies only such changes.
    pub is_certain: bool,
}

impl Diagnostic {
    /// Creates a diagnostic with a headline and nothing else.
    pub fn new(code: DiagnosticCode, span: Span, message: impl Into<String>) -> Self {
        Diagnostic {
            code,
            message: message.into(),
            span,
            label: String::new(),
            related: Vec::new(),
            help: None,
            edits: Vec::new(),
        }
    }

    /// Writes `label` under the marked source text.
    pub fn label(mut self, label: impl Into<String>) -> Self {
        self.label = label.into();
        self
    }

    /// Adds another place that explains this one.
    pub fn related(mut self, span: Span, text: impl Into<String>) -> Self {
        self.related.push((span, text.into()));
        self
    }

    /// Adds advice how to correct the mistake.
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// Adds a change that certainly corrects the mistake.
    pub fn edit(mut self, span: Span, text: impl Into<String>) -> Self {
        self.edits.push(Edit { span, text: text.into(), is_certain: true });
        self
    }

    /// Adds a change that likely corrects the mistake.
    pub fn guess(mut self, span: Span, text: impl Into<String>) -> Self {
        self.edits.push(Edit { span, text: text.into(), is_certain: false });
        self
    }

    /// Returns the severity of the code.
    pub fn severity(&self) -> Severity {
        self.code.severity()
    }
}
