//! Messages about scripts and scenarios, in the format of `bbz check --json`.

use bittybuzz_arena::scenario::ScenarioError;
use bittybuzz_compiler::diagnostic::{Diagnostic, Severity};
use bittybuzz_compiler::render::{DescribedEdit, DescribedPlace, DescribedSpan, Renderer};
use bittybuzz_toml_reader::Place;
use serde::Serialize;

use crate::scenario_comments::ScenarioWarning;

/// A message of the compiler, or about a scenario.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct CompilerMessage {
    pub severity: MessageSeverity,
    /// The code, such as `E0201`. Messages about a scenario have none.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional))]
    pub code: Option<String>,
    pub message: String,
    pub label: Option<String>,
    pub help: Option<String>,
    /// The place, which is absent from a message about a file as a whole. Lines and columns count
    /// from 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional))]
    pub file: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional))]
    pub line: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional))]
    pub column: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional))]
    pub end_line: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional))]
    pub end_column: Option<usize>,
    /// Other places that the message refers to.
    pub related: Vec<RelatedPlace>,
    /// Changes of the text that the message suggests.
    pub edits: Vec<SuggestedEdit>,
}

/// The severity of a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "snake_case")]
pub enum MessageSeverity {
    Error,
    Warning,
}

/// A place with a remark.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct RelatedPlace {
    pub file: String,
    pub line: usize,
    pub column: usize,
    pub end_line: usize,
    pub end_column: usize,
    pub label: String,
}

/// A text that replaces the one at a place.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct SuggestedEdit {
    pub file: String,
    pub line: usize,
    pub column: usize,
    pub end_line: usize,
    pub end_column: usize,
    pub text: String,
    /// True if the change is certainly right.
    pub certain: bool,
}

impl CompilerMessage {
    /// Returns an error without a place.
    pub fn error(message: impl Into<String>) -> Self {
        CompilerMessage {
            severity: MessageSeverity::Error,
            code: None,
            message: message.into(),
            label: None,
            help: None,
            file: None,
            line: None,
            column: None,
            end_line: None,
            end_column: None,
            related: Vec::new(),
            edits: Vec::new(),
        }
    }

    /// Returns a message of the compiler.
    pub fn of_diagnostic(renderer: &Renderer<'_>, diagnostic: &Diagnostic) -> Self {
        let described = renderer.described(diagnostic);
        let related = described.related.into_iter().map(|DescribedPlace { place, label }| {
            let DescribedSpan { file, line, column, end_line, end_column } = place;
            RelatedPlace { file, line, column, end_line, end_column, label }
        });
        let edits = described.edits.into_iter().map(|DescribedEdit { place, text, certain }| {
            let DescribedSpan { file, line, column, end_line, end_column } = place;
            SuggestedEdit { file, line, column, end_line, end_column, text, certain }
        });
        CompilerMessage {
            severity: match diagnostic.severity() {
                Severity::Error => MessageSeverity::Error,
                Severity::Warning => MessageSeverity::Warning,
            },
            code: Some(described.code.to_owned()),
            message: described.message,
            label: Some(described.label),
            help: described.help,
            file: Some(described.place.file),
            line: Some(described.place.line),
            column: Some(described.place.column),
            end_line: Some(described.place.end_line),
            end_column: Some(described.place.end_column),
            related: related.collect(),
            edits: edits.collect(),
        }
    }

    /// Returns a mistake of a scenario as a message.
    pub fn of_scenario(error: &ScenarioError) -> Self {
        let message =
            CompilerMessage { help: error.help(), ..CompilerMessage::error(error.to_string()) };
        match &error.place {
            Some(place) => message.at(place),
            None => message,
        }
    }

    /// Returns a warning about a comment of a scenario as a message.
    pub fn of_scenario_comment(warning: &ScenarioWarning) -> Self {
        let message = CompilerMessage {
            severity: MessageSeverity::Warning,
            help: Some(warning.help.clone()),
            ..CompilerMessage::error(&*warning.message)
        };
        message.at(&warning.place)
    }

    fn at(self, place: &Place) -> Self {
        CompilerMessage {
            file: Some(place.path.clone()),
            line: Some(place.line),
            column: Some(place.column),
            end_line: Some(place.line),
            end_column: Some(place.column + place.width),
            ..self
        }
    }
}
