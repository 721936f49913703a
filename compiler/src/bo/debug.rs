//! Reads a `.bdb` file, which maps each instruction of a `.bo` file to a place in the script.
//!
//! The file is a sequence of records without a header: offset in the `.bo` file (4 bytes), line
//! (8), column (8), length of the file name (2), file name; all little-endian.

use std::collections::{BTreeMap, HashMap};
use std::fmt;

use crate::bo::read::Bo;

/// The places of a `.bdb` file.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct DebugInfo {
    /// Paths of the source files, in order of first appearance.
    pub files: Vec<String>,
    places: BTreeMap<usize, DebugPlace>,
}

/// A place in a source file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DebugPlace {
    /// Number in [`DebugInfo::files`].
    pub file: usize,
    /// The line, from 1.
    pub line: u32,
    /// The column, from 1.
    pub column: u32,
}

/// A reason why a `.bdb` file cannot be used. The program runs without it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DebugError {
    /// The file ends inside the record at this offset.
    Truncated(usize),
    /// The file name of the record at this offset is not UTF-8.
    NotUtf8(usize),
    /// The record at this offset refers to a place where no instruction starts, so the debug file
    /// belongs to another `.bo` file.
    OtherProgram(usize),
}

impl fmt::Display for DebugError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            DebugError::Truncated(at) => {
                write!(f, "the debug file ends inside the record at offset {at}")
            }
            DebugError::NotUtf8(at) => {
                write!(f, "a file name in the debug file is not UTF-8 (offset {at})")
            }
            DebugError::OtherProgram(at) => {
                write!(f, "the debug file belongs to another .bo file (offset {at})")
            }
        }
    }
}

impl std::error::Error for DebugError {}

impl DebugInfo {
    /// Reads the file that belongs to `bo`.
    pub fn read(bytes: &[u8], bo: &Bo) -> Result<DebugInfo, DebugError> {
        let mut info = DebugInfo::default();
        let mut numbers = HashMap::new();
        let mut at = 0;
        while at < bytes.len() {
            let start = at;
            let mut take = |length: usize| {
                let taken = bytes.get(at..).and_then(|rest| rest.get(..length));
                at += length;
                taken.ok_or(DebugError::Truncated(start))
            };
            let offset = number(take(4)?);
            let (line, column) = (number(take(8)?), number(take(8)?));
            let length = number(take(2)?) as usize;
            let name = take(length)?;
            let name = std::str::from_utf8(name).map_err(|_| DebugError::NotUtf8(start))?;
            let instruction = usize::try_from(offset)
                .ok()
                .filter(|offset| bo.code.binary_search_by_key(offset, |i| i.offset).is_ok());
            let Some(offset) = instruction else { return Err(DebugError::OtherProgram(start)) };
            // For code after the end of the script, the Buzz compiler writes line 0 of no file.
            if line == 0 {
                continue;
            }
            let file = *numbers.entry(name).or_insert_with(|| {
                info.files.push(name.to_owned());
                info.files.len() - 1
            });
            let (line, column) = (saturate(line), saturate(column));
            info.places.insert(offset, DebugPlace { file, line, column });
        }
        Ok(info)
    }

    /// Returns the source of the instruction at an offset.
    pub fn place(&self, offset: usize) -> Option<DebugPlace> {
        self.places.get(&offset).copied()
    }
}

fn number(bytes: &[u8]) -> u64 {
    bytes.iter().rev().fold(0, |number, byte| number << 8 | u64::from(*byte))
}

fn saturate(number: u64) -> u32 {
    u32::try_from(number).unwrap_or(u32::MAX)
}
