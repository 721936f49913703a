//! A run-time error as data, for pages.

use bittybuzz_compiler::render::WIDE_LINE;
use bittybuzz_compiler::symbols::SourceSpan;
use serde::Serialize;

use crate::program::KnownProgram;

/// A run-time error in words, with its place, values and calls.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "declarations", derive(ts_rs::TS))]
pub struct FaultDescription {
    /// The code, such as `R0001`.
    pub code: String,
    /// The mistake, in one sentence without a full stop.
    pub message: String,
    pub help: Option<String>,
    /// Further remarks, such as the use of a memory that was full.
    pub notes: Vec<String>,
    /// The values that the instruction used, if the machine was inspected at that moment.
    pub values: Vec<FaultValue>,
    /// The calls that led to the error, innermost first; `None` without symbols. Of many calls,
    /// only the first and the last ones.
    pub places: Vec<Option<FaultPlace>>,
    /// The number of calls that `places` lacks.
    pub left_out: usize,
}

/// A variable, or an entry of a table, and its value at the moment of the error.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "declarations", derive(ts_rs::TS))]
pub struct FaultValue {
    /// The name as it is written in the script, such as `speeds[i]`.
    pub name: String,
    /// The value as a script would write it.
    pub value: String,
}

/// The place of a call in its source. Lines and columns count from 1, and the end is exclusive.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "declarations", derive(ts_rs::TS))]
pub struct FaultPlace {
    pub file: String,
    pub line: u32,
    pub column: u32,
    pub end_line: u32,
    pub end_column: u32,
    /// The name of the function; `None` if the symbols have none.
    pub function: Option<String>,
    /// The text of the line, if it is known.
    pub text: Option<String>,
    /// The name of the script in the client's editor; `None` if the client cannot edit it.
    pub script: Option<String>,
}

impl FaultPlace {
    /// Returns the place of the code at a position, whose source is known; `None` without symbols.
    pub fn new(program: KnownProgram<'_>, position: u32, source: SourceSpan) -> Option<FaultPlace> {
        let symbols = program.symbols?;
        let SourceSpan { file, line, column, end_line, end_column } = source;
        let known = program.sources.source(file);
        let index = usize::try_from(line.saturating_sub(1)).ok()?;
        let text = known.as_deref().and_then(|text| text.lines().nth(index));
        Some(FaultPlace {
            file: symbols.file(file)?.to_owned(),
            line,
            column,
            end_line,
            end_column,
            function: symbols.function(position).map(|function| function.name.clone()),
            text: text.filter(|line| line.len() <= WIDE_LINE).map(str::to_owned),
            script: None,
        })
    }
}
