//! The symbols of an image: names, texts and places that only the host needs, stored next to the
//! image as `.sym` (JSON).
//!
//! A robot reports numbers: a position, a function, a string. The symbols with the same script hash
//! translate them to file, line and column, names and text. Positions count from the start of the
//! image's code, as in faults.

use std::fmt;

use serde::de::Error as _;
use serde::{Deserialize, Serialize};

use bittybuzz_vm_core::builtin;

use crate::source::{SourceMap, Span};

/// Version of the `.sym` format.
pub const FORMAT: u32 = 3;

/// The symbols of an image.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Symbols {
    /// [`FORMAT`]
    pub format: u32,
    /// `tiny` or `full`.
    pub profile: String,
    /// The image's script hash.
    pub script_hash: u32,
    /// The robot that the image was built for, if one was named.
    pub robot: Option<String>,
    /// Source files; the main script is number 0.
    pub files: Vec<String>,
    /// Functions by number.
    pub functions: Vec<FunctionSymbol>,
    /// Strings of the script. The first one has the number after the machine's own strings.
    pub strings: Vec<String>,
    /// Names of the globals, by number.
    pub globals: Vec<String>,
    /// Names of the imported robot functions, by number.
    pub imports: Vec<String>,
    /// The sources of the code, by ascending offset.
    pub lines: Vec<LineEntry>,
    /// The first byte of each statement, by ascending offset, and its source. A branch or a loop
    /// has one for each condition.
    pub statements: Vec<LineEntry>,
}

/// A function of the image.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct FunctionSymbol {
    /// The name; for a lambda its place in the source.
    pub name: String,
    /// Offset of the function's header in the code.
    pub offset: u32,
    /// Parameters, variables, captured values and `self`, sorted by the start of their ranges.
    pub locals: Vec<LocalSymbol>,
}

/// A name in a function, with the range of code in which it has one place. Its JSON form is an
/// array.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LocalSymbol {
    /// The name in the source.
    pub name: String,
    pub place: LocalPlace,
    /// Offset of the first byte of the range. A variable's range starts after the instruction that
    /// yields its first value.
    pub from: u32,
    /// Offset of the first byte after the range.
    pub to: u32,
}

/// The place of a local's value while its function runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LocalPlace {
    /// A slot, by its offset from the frame record as in instructions: parameters are below 0, all
    /// others above.
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

/// The source of the code from `offset` to the next entry. Its JSON form is an array.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LineEntry {
    /// Offset of the first byte of the code.
    pub offset: u32,
    pub place: SourceSpan,
}

/// A range of source text. Lines and columns count from 1, and columns count characters. The end is
/// exclusive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SourceSpan {
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
        let SourceSpan { file, line, column, end_line, end_column } = self.place;
        [self.offset, file, line, column, end_line, end_column].serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for LineEntry {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let [offset, file, line, column, end_line, end_column] =
            <[u32; 6]>::deserialize(deserializer)?;
        Ok(LineEntry { offset, place: SourceSpan { file, line, column, end_line, end_column } })
    }
}

/// A reason why a `.sym` file cannot be used.
#[derive(Debug)]
pub enum SymbolsError {
    /// The file is not in the format of this version.
    Malformed(serde_json::Error),
    /// The file has another version of the format.
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
    /// Returns the text of a `.sym` file.
    pub fn to_json(&self) -> String {
        serde_json::to_string(self)
            .expect("only maps with keys that are not strings, and failing writers, can fail")
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

    /// Returns the source of the instruction at that position.
    pub fn position(&self, position: u32) -> Option<SourceSpan> {
        let after = self.lines.partition_point(|entry| entry.offset <= position);
        Some(self.lines.get(after.checked_sub(1)?)?.place)
    }

    /// Returns the source of the statement that begins at that position; `None` if none does.
    pub fn statement(&self, position: u32) -> Option<SourceSpan> {
        let found = self.statements.binary_search_by_key(&position, |entry| entry.offset).ok()?;
        Some(self.statements[found].place)
    }

    /// Returns the function that contains that position.
    pub fn function(&self, position: u32) -> Option<&FunctionSymbol> {
        let after = self.functions.partition_point(|function| function.offset <= position);
        self.functions.get(after.checked_sub(1)?)
    }

    /// Returns the names in scope at the instruction that contains that position, innermost first.
    /// An outer name that an inner one shadows is left out.
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

    /// Returns the path of a file.
    pub fn file(&self, file: u32) -> Option<&str> {
        self.files.get(usize::try_from(file).ok()?).map(String::as_str)
    }

    /// Returns the text of a string, also of the machine's own.
    pub fn string(&self, number: u16) -> Option<&str> {
        match number.checked_sub(builtin::string::COUNT) {
            Some(index) => self.strings.get(usize::from(index)).map(String::as_str),
            None => builtin::STRINGS.get(usize::from(number)).copied(),
        }
    }
}

/// Returns the lines and columns of a span.
pub(crate) fn place(sources: &SourceMap, span: Span) -> SourceSpan {
    let [start, end] = [span.start, span.end].map(|at| sources.position(span.file, at));
    let (line, column) = (start.line, start.column);
    SourceSpan { file: span.file.0, line, column, end_line: end.line, end_column: end.column }
}
