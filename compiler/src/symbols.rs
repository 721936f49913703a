//! The host's knowledge of an image: names, texts and places, kept beside it as `.sym` (JSON).
//!
//! A robot reports numbers: a position, a function, a string. With the symbols of the same script
//! hash these become
//! file, line and column, names and text. Positions count from the start of the image's code, as
//! faults do.

use std::fmt;

use serde::de::Error as _;
use serde::{Deserialize, Serialize};

use bittybuzz_vm_core::builtin;

use crate::source::{FileId, SourceMap, Span};

/// Version of the `.sym` format.
pub const FORMAT: u32 = 2;

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
    /// The sources of the code, in order.
    pub lines: Vec<LineEntry>,
}

/// A function of the image.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct FunctionSymbol {
    /// Its name; for a lambda where it is written.
    pub name: String,
    /// The place of its header in the code.
    pub offset: u32,
    /// Its parameters, variables, captured values and `self`, by the start of their ranges.
    pub locals: Vec<LocalSymbol>,
}

/// A name in a function, and the code in which it has that place. As JSON an array.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LocalSymbol {
    /// The name in the source.
    pub name: String,
    /// The place of its value.
    pub place: LocalPlace,
    /// First byte of the code in which the name has that place: before the first instruction after that of its first value.
    pub from: u32,
    /// First byte after that code.
    pub to: u32,
}

/// The place of a local's value while its function runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LocalPlace {
    /// A slot, by its offset from the frame's record as instructions name it: parameters are below 0, all others above.
    Frame(i16),
    /// A captured value of the function's closure, by its number.
    Capture(u16),
}

/// The second column of a row of locals.
#[derive(Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum LocalKind {
    Frame,
    Capture,
}

impl Serialize for LocalSymbol {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let (kind, number) = match self.place {
            LocalPlace::Frame(offset) => (LocalKind::Frame, i32::from(offset)),
            LocalPlace::Capture(number) => (LocalKind::Capture, i32::from(number)),
        };
        (&self.name, kind, number, self.from, self.to).serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for LocalSymbol {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let (name, kind, number, from, to) =
            <(String, LocalKind, i32, u32, u32)>::deserialize(deserializer)?;
        let out_of_range = |_| D::Error::custom(format!("`{name}` has no place {number}"));
        let place = match kind {
            LocalKind::Frame => LocalPlace::Frame(i16::try_from(number).map_err(out_of_range)?),
            LocalKind::Capture => LocalPlace::Capture(u16::try_from(number).map_err(out_of_range)?),
        };
        Ok(LocalSymbol { name, place, from, to })
    }
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

/// A reason why a `.sym` file cannot be used.
#[derive(Debug)]
pub enum SymbolsError {
    /// It is not in the format of this version.
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

    /// The names that a function can use at the instruction that holds that position, the innermost first. Of two with
    /// one name only the inner one is among them.
    pub fn locals(&self, position: u32) -> Vec<&LocalSymbol> {
        let all = self.function(position).map_or(&[][..], |function| &function.locals);
        let mut live: Vec<&LocalSymbol> = Vec::new();
        let here = all.iter().rev().filter(|local| (local.from..local.to).contains(&position));
        for local in here {
            if live.iter().all(|inner| inner.name != local.name) {
                live.push(local);
            }
        }
        live
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
