//! What the host knows of an image: names, texts and places, kept beside it as `.sym` (JSON).
//!
//! A robot reports numbers: a position, a function, a string. With the symbols of the same script hash these become
//! file, line and column, names and text. Positions count from the start of the image's code, as faults do.

use std::fmt;

use serde::{Deserialize, Serialize};

use bittybuzz_vm_core::builtin;

use crate::source::{FileId, SourceMap, Span};

/// Version of the `.sym` format.
pub const FORMAT: u32 = 1;

/// The symbols of an image.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Symbols {
    /// [`FORMAT`]
    pub format: u32,
    /// `tiny` or `full`.
    pub profile: String,
    /// The image's script hash.
    pub script_hash: u32,
    /// The robot that it was built for, if one was named.
    pub robot: Option<String>,
    /// Source files; the main script is number 0.
    pub files: Vec<String>,
    /// Functions by number.
    pub functions: Vec<FunctionSymbol>,
    /// Strings of the script, by number after those of the machine.
    pub strings: Vec<String>,
    /// Names of the globals, by number.
    pub globals: Vec<String>,
    /// Names of the imported robot functions, by number.
    pub imports: Vec<String>,
    /// Where the code comes from, in order.
    pub lines: Vec<LineEntry>,
}

/// A function of the image.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct FunctionSymbol {
    /// Its name; for a lambda where it is written.
    pub name: String,
    /// Where its header is in the code.
    pub offset: u32,
}

/// From `offset` on, up to the next entry, the code comes from this piece of source. As JSON an array.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LineEntry {
    /// First byte of the code.
    pub offset: u32,
    /// The piece of source.
    pub place: Place,
}

/// A piece of source. Lines and columns count from 1, columns in characters; the end is not part of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Place {
    /// Number of the file in [`Symbols::files`].
    pub file: u32,
    /// Line of the start.
    pub line: u32,
    /// Column of the start.
    pub column: u32,
    /// Line of the end.
    pub end_line: u32,
    /// Column of the end.
    pub end_column: u32,
}

impl Serialize for LineEntry {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Place { file, line, column, end_line, end_column } = self.place;
        [self.offset, file, line, column, end_line, end_column].serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for LineEntry {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let [offset, file, line, column, end_line, end_column] =
            <[u32; 6]>::deserialize(deserializer)?;
        Ok(LineEntry { offset, place: Place { file, line, column, end_line, end_column } })
    }
}

/// Why a `.sym` file cannot be used.
#[derive(Debug)]
pub enum SymbolsError {
    /// It is not what this version writes.
    Malformed(serde_json::Error),
    /// It was written by another version.
    Format(u32),
}

impl fmt::Display for SymbolsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            SymbolsError::Malformed(error) => write!(f, "not a symbol file: {error}"),
            SymbolsError::Format(found) => {
                let age = if *found < FORMAT { "older" } else { "newer" };
                write!(
                    f,
                    "a symbol file of format {found}, {age} than format {FORMAT}, which this `bbz` reads"
                )
            }
        }
    }
}

impl std::error::Error for SymbolsError {}

impl Symbols {
    /// The text of a `.sym` file.
    pub fn to_json(&self) -> String {
        // Only maps with keys that are no strings and failing writers make serialising fail; there are none here.
        serde_json::to_string(self).unwrap_or_default()
    }

    /// Reads a `.sym` file.
    pub fn from_json(text: &str) -> Result<Symbols, SymbolsError> {
        #[derive(Deserialize)]
        struct Version {
            format: u32,
        }
        let version: Version = serde_json::from_str(text).map_err(SymbolsError::Malformed)?;
        if version.format != FORMAT {
            return Err(SymbolsError::Format(version.format));
        }
        serde_json::from_str(text).map_err(SymbolsError::Malformed)
    }

    /// The piece of source that the instruction at that position comes from.
    pub fn position(&self, position: u32) -> Option<Place> {
        let after = self.lines.partition_point(|entry| entry.offset <= position);
        Some(self.lines.get(after.checked_sub(1)?)?.place)
    }

    /// The function that holds that position.
    pub fn function(&self, position: u32) -> Option<&FunctionSymbol> {
        let after = self.functions.partition_point(|function| function.offset <= position);
        self.functions.get(after.checked_sub(1)?)
    }

    /// Path of a file.
    pub fn file(&self, file: u32) -> Option<&str> {
        self.files.get(usize::try_from(file).ok()?).map(String::as_str)
    }

    /// The text of a string, the machine's own included.
    pub fn string(&self, number: u16) -> Option<&str> {
        match number.checked_sub(builtin::string::COUNT) {
            Some(index) => self.strings.get(usize::from(index)).map(String::as_str),
            None => builtin::STRINGS.get(usize::from(number)).copied(),
        }
    }
}

/// Finds lines and columns fast enough for every instruction of a long script.
pub(crate) struct Places<'a> {
    sources: &'a SourceMap,
    /// For each file, where its lines start.
    lines: Vec<Vec<usize>>,
}

impl<'a> Places<'a> {
    pub(crate) fn new(sources: &'a SourceMap) -> Self {
        let starts = |text: &str| {
            let after_newlines = text.match_indices('\n').map(|(at, _)| at + 1);
            std::iter::once(0).chain(after_newlines).collect()
        };
        Places { sources, lines: sources.files().map(|(_, file)| starts(&file.text)).collect() }
    }

    pub(crate) fn place(&self, span: Span) -> Place {
        let (line, column) = self.line_column(span.file, span.start);
        let (end_line, end_column) = self.line_column(span.file, span.end);
        Place { file: span.file.0, line, column, end_line, end_column }
    }

    fn line_column(&self, file: FileId, at: u32) -> (u32, u32) {
        let Some(lines) = self.lines.get(file.0 as usize) else { return (1, 1) };
        let text = &self.sources.file(file).text;
        let at = (at as usize).min(text.len());
        let line = lines.partition_point(|start| *start <= at).max(1);
        let start = lines.get(line - 1).copied().unwrap_or(0);
        let column = text.get(start..at).map_or(0, |before| before.chars().count());
        (line as u32, column as u32 + 1)
    }
}
