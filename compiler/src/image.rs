//! Writes images in the format of `docs/image-format.md`.

use std::fmt;
use std::ops::Range;

use bittybuzz_vm_core::builtin::Feature;
use bittybuzz_vm_core::image::{
    COUNT_MAX, FORM_CLASSES, FORM_FULL, FORM_LIBRARIES, FORM_ORDER, FORM_TEXT, MAGIC, VERSION,
};
use bittybuzz_vm_core::message::STIGMERGIES;

use crate::asm::FunctionCode;
use crate::source::Span;
use crate::strings::StringTable;

pub use bittybuzz_vm_core::image::EntryPoint;

/// The functions that the host calls, in the order of the image header.
pub const ENTRIES: [&str; 4] = ["init", "step", "reset", "destroy"];

/// The maximum size of an image in bytes.
pub const BYTES_MAX: usize = 0xff00;

/// The hash of the script's text in an image, after magic, form and features.
const SCRIPT_HASH: Range<usize> = 3..7;

/// Returns an image without the hash of its script's text. Scripts that differ in comments and spaces
/// alone have equal ones.
pub fn without_script_hash(mut image: Vec<u8>) -> Vec<u8> {
    if let Some(hash) = image.get_mut(SCRIPT_HASH) {
        hash.fill(0);
    }
    image
}

/// A row of the library table, which maps a member of a library to a built-in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct LibraryRow {
    pub library: u8,
    /// The string number of the member's name.
    pub string: u16,
    pub builtin: u8,
}

/// The contents of an image.
#[derive(Debug, Clone, Default)]
pub struct ImageContent {
    /// True if the number profile is `full`.
    pub full: bool,
    /// Feature bits, except the one for the stigmergy table.
    pub features: u8,
    /// The hash that identifies the source, the profile and the version of the messages.
    pub script_hash: u32,
    /// The entry points `init`, `step`, `reset` and `destroy`, encoded by [`EntryPoint::to_count`].
    pub entries: [u16; 4],
    /// Number of globals.
    pub globals: usize,
    /// The stigmergy table: the number in the script of each stigmergy whose entries fit one frame.
    pub stigmergies: Option<[u16; STIGMERGIES as usize]>,
    /// Name hashes of imported robot functions.
    pub imports: Vec<u16>,
    pub strings: StringTable,
    /// True if the image has an order table.
    pub order: bool,
    /// True if the image holds the text of the strings.
    pub text: bool,
    /// Rows of the library table, in any order.
    pub libraries: Vec<LibraryRow>,
    /// The class table: a byte for all names that are not strings of the script, then one for each
    /// of its strings. Empty if the image has no class table.
    pub classes: Vec<u8>,
    /// The functions; number 0 is the global code.
    pub functions: Vec<FunctionCode>,
}

/// An image and its layout.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CompiledImage {
    pub bytes: Vec<u8>,
    /// Offset of the code in `bytes`. All positions below count from there, as in faults.
    pub code_at: usize,
    /// The positions of the functions' headers.
    pub functions: Vec<usize>,
    /// The sources of the instructions, ascending. The position is that of the first of consecutive
    /// instructions with the same span.
    pub lines: Vec<(usize, Span)>,
}

impl CompiledImage {
    /// Returns the source of the instruction at that position.
    pub fn source(&self, at: usize) -> Span {
        let line = self.lines.iter().rev().find(|(start, _)| *start <= at);
        line.map_or(Span::default(), |(_, span)| *span)
    }
}

/// A reason why a script has no image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ImageBuildError {
    /// A count in the header would exceed 32767.
    Count {
        /// The name of the things that are too many.
        what: &'static str,
        count: usize,
    },
    /// A string of more than 32767 bytes.
    StringLength(usize),
    /// The whole image would exceed [`BYTES_MAX`].
    Length(usize),
}

impl fmt::Display for ImageBuildError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ImageBuildError::Count { what, count } => {
                write!(f, "{count} {what}, at most {COUNT_MAX} fit an image")
            }
            ImageBuildError::StringLength(length) => {
                write!(f, "a string of {length} bytes, at most {COUNT_MAX} fit an image")
            }
            ImageBuildError::Length(length) => {
                write!(f, "the image would have {length} bytes, at most {BYTES_MAX} are possible")
            }
        }
    }
}

impl std::error::Error for ImageBuildError {}

impl ImageContent {
    /// Writes the image.
    pub fn write(&self) -> Result<CompiledImage, ImageBuildError> {
        let mut form = VERSION;
        form |= if self.full { FORM_FULL } else { 0 };
        form |= if self.order { FORM_ORDER } else { 0 };
        form |= if self.text { FORM_TEXT } else { 0 };
        form |= if self.libraries.is_empty() { 0 } else { FORM_LIBRARIES };
        form |= if self.classes.is_empty() { 0 } else { FORM_CLASSES };
        let has_table = self.stigmergies.is_some();
        let table = if has_table { Feature::StigmergyTable as u8 } else { 0 };
        let mut bytes = vec![MAGIC, form, self.features | table];
        bytes.extend(self.script_hash.to_le_bytes());
        for entry in self.entries {
            count(&mut bytes, "entries", usize::from(entry))?;
        }
        count(&mut bytes, "globals", self.globals)?;
        count(&mut bytes, "functions", self.functions.len())?;
        count(&mut bytes, "robot functions", self.imports.len())?;
        count(&mut bytes, "strings", self.strings.script().len())?;
        for number in self.stigmergies.iter().flatten() {
            bytes.extend(number.to_le_bytes());
        }
        for import in &self.imports {
            bytes.extend(import.to_le_bytes());
        }
        if self.order {
            bytes.extend(self.strings.order());
        }
        if !self.libraries.is_empty() {
            let mut rows = self.libraries.clone();
            rows.sort_unstable();
            rows.dedup();
            count(&mut bytes, "library members", rows.len())?;
            for row in rows {
                bytes.push(row.library);
                bytes.extend(row.string.to_le_bytes());
                bytes.push(row.builtin);
            }
        }
        bytes.extend(&self.classes);
        let mut offset = 0;
        for function in &self.functions {
            // An offset above 65535 makes the image longer than `BYTES_MAX`, which is checked
            // below.
            bytes.extend((offset as u16).to_le_bytes());
            offset += function.bytes.len();
        }
        if self.text {
            for text in self.strings.script() {
                if text.len() > COUNT_MAX {
                    return Err(ImageBuildError::StringLength(text.len()));
                }
                count(&mut bytes, "bytes", text.len())?;
                bytes.extend(text.as_bytes());
            }
        }
        let code_at = bytes.len();
        let mut functions = Vec::with_capacity(self.functions.len());
        let mut lines = Vec::new();
        for function in &self.functions {
            let start = bytes.len() - code_at;
            functions.push(start);
            lines.extend(function.lines.iter().map(|(at, span)| (start + at, *span)));
            bytes.extend(&function.bytes);
        }
        if bytes.len() > BYTES_MAX {
            return Err(ImageBuildError::Length(bytes.len()));
        }
        Ok(CompiledImage { bytes, code_at, functions, lines })
    }
}

fn count(bytes: &mut Vec<u8>, what: &'static str, number: usize) -> Result<(), ImageBuildError> {
    if number > COUNT_MAX {
        return Err(ImageBuildError::Count { what, count: number });
    }
    if number < 0x80 {
        bytes.push(number as u8);
    } else {
        bytes.extend([(number >> 8) as u8 | 0x80, number as u8]);
    }
    Ok(())
}
