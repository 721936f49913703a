//! Imports Buzz object files (`.bo`), as the compiler of the reference implementation writes them,
//! and compiles them to the same image as their source.
//!
//! That compiler does not optimize, so the statements of the script can be recovered from its
//! instructions, except for the names of locals and the numbers of parameters. [`import`] builds a
//! syntax tree from them and compiles it like any other, so all checks and the code generator work
//! on a `.bo` file, too. Code from other compilers is refused instead of guessed at.
//!
//! # Steps
//! | | |
//! |---|---|
//! | [`read`] | decodes bytes to instructions |
//! | `chunks` | divides the instructions into global code, functions and lambdas |
//! | `structure`, `stack` | recover the statements and expressions of each chunk |
//! | `locals`, `arity` | find the number of parameters of each function |
//! | `script` | builds the syntax tree |
//!
//! # Differences from the script
//! * `land` and `lor` evaluate both sides, as they always did in Buzz.
//! * The script hash covers the bytes of the file, so robots with the image of the script and of
//!   the `.bo` file do not exchange messages.
//! * Places in diagnostics and symbols are lines of the [`listing`]. If the `.bdb` file is present,
//!   symbols refer to lines of the script.

mod arity;
mod chunks;
pub mod debug;
pub mod error;
pub mod instruction;
pub mod listing;
mod locals;
mod names;
pub mod read;
mod script;
mod stack;
mod structure;

use std::fmt;
use std::path::Path;

use bittybuzz_vm_core::hash::fnv_1a;

use crate::codes::DiagnosticCode;
use crate::compile::{Compiled, Options, compile_parsed};
use crate::parser::{Hidden, Parsed};
use crate::source::SourceMap;
use crate::symbols::{SourceSpan, Symbols};
use debug::{DebugError, DebugInfo};
use error::BoError;
use listing::BoListing;
use read::Bo;

/// The result of importing a `.bo` file.
#[derive(Debug, Clone)]
pub struct Imported {
    /// The result of compilation. Its source is the listing.
    pub compiled: Compiled,
    /// Warnings about the file itself.
    pub warnings: Vec<Warning>,
}

/// A flaw of a `.bo` file that can be run nevertheless.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Warning {
    /// The debug file cannot be used.
    Debug(DebugError),
    /// The lambda at this offset, created in a block of the global code, uses local 0. Local 0 is
    /// `self`, but in a block with braces the Buzz compiler means the first parameter.
    TopLevelLambda(usize),
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Warning::Debug(error) => error.fmt(f),
            Warning::TopLevelLambda(offset) => write!(
                f,
                "the function at offset {offset} may find nil instead of its first argument: in a block of the \
                 global code the Buzz compiler numbers parameters wrongly; compile the script instead of the .bo file"
            ),
        }
    }
}

/// Compiles the `.bo` file at `path` to an image; `debug` is the `.bdb` file next to it.
pub fn import(
    path: &Path,
    bytes: &[u8],
    debug: Option<&[u8]>,
    options: &Options,
) -> Result<Imported, BoError> {
    let bo = Bo::read(bytes)?;
    let listing = BoListing::new(&bo);
    let recovered = script::recover(&bo, &listing)?;
    let doubtful = recovered.doubtful_lambdas.iter();
    let mut warnings: Vec<Warning> =
        doubtful.map(|start| Warning::TopLevelLambda(bo.offset(*start))).collect();
    let debug = debug.and_then(|bytes| {
        DebugInfo::read(bytes, &bo).map_err(|error| warnings.push(Warning::Debug(error))).ok()
    });
    let mut sources = SourceMap::default();
    sources.add(path, listing.text.clone());
    let mut compiled = compile_parsed(
        Parsed {
            script: recovered.script,
            sources,
            diagnostics: Vec::new(),
            token_hash: fnv_1a(bytes),
            strings: recovered.strings,
            hidden: Hidden::default(),
        },
        options,
    );
    // A parameter that a function does not use is not recovered, so a warning about extra arguments
    // may be wrong.
    compiled.diagnostics.retain(|diagnostic| diagnostic.code != DiagnosticCode::ExtraArguments);
    if let Some(debug) = debug {
        let script = ScriptPlaces { bo: &bo, debug };
        for diagnostic in &mut compiled.diagnostics {
            if let Some(text) = script.text(listing.instruction(diagnostic.span)) {
                let separator = if diagnostic.label.is_empty() { "" } else { " " };
                diagnostic.label.push_str(&format!("{separator}({text})"));
            }
        }
        if let Some(symbols) = &mut compiled.symbols {
            script.translate(symbols);
        }
    }
    Ok(Imported { compiled, warnings })
}

/// Returns the text of a `.bo` file, one line per instruction: `OFFSET: mnemonic argument`.
pub fn disassemble(bytes: &[u8]) -> Result<String, BoError> {
    Ok(BoListing::new(&Bo::read(bytes)?).text)
}

/// Translates lines of the listing to places in the script.
struct ScriptPlaces<'a> {
    bo: &'a Bo,
    debug: DebugInfo,
}

impl ScriptPlaces<'_> {
    /// Returns the place in the script of instruction number `at`.
    fn text(&self, at: usize) -> Option<String> {
        let place = self.debug.place(self.bo.offset(at))?;
        let file = self.debug.files.get(place.file)?;
        Some(format!("{file}:{}:{}", place.line, place.column))
    }

    fn translate(&self, symbols: &mut Symbols) {
        let first = symbols.files.len() as u32;
        let listing = symbols.files.first().cloned().unwrap_or_default();
        symbols.files.extend(self.debug.files.iter().cloned());
        for entry in symbols.lines.iter_mut().chain(&mut symbols.statements) {
            // Line 1 is instruction 0.
            let at = entry.place.line.saturating_sub(1) as usize;
            if let Some(place) = self.debug.place(self.bo.offset(at)) {
                let (line, column) = (place.line, place.column);
                let file = first + place.file as u32;
                entry.place = SourceSpan { file, line, column, end_line: line, end_column: column };
            }
        }
        for function in &mut symbols.functions {
            let line = function.name.strip_prefix("lambda at ").and_then(|place| {
                place.strip_prefix(&listing)?.strip_prefix(':')?.parse::<usize>().ok()
            });
            if let Some(at) = line.and_then(|line| line.checked_sub(1))
                && let Some(place) = self.debug.place(self.bo.offset(at))
                && let Some(file) = self.debug.files.get(place.file)
            {
                function.name = format!("lambda at {file}:{}", place.line);
            }
        }
    }
}
