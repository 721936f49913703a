//! A program, as far as it is known.

use std::borrow::Cow;

use bittybuzz_compiler::source::SourceMap;
use bittybuzz_compiler::symbols::Symbols;
use bittybuzz_robot_spec::NumberProfile;
use bittybuzz_vm_core::builtin;

/// The texts of a program's source files.
pub trait SourceTexts {
    /// Returns the text of a file by its number in the symbols; `None` if it is not known.
    fn source(&self, file: u32) -> Option<Cow<'_, str>>;
}

impl SourceTexts for SourceMap {
    fn source(&self, file: u32) -> Option<Cow<'_, str>> {
        let (_, found) = self.files().find(|(id, _)| id.0 == file)?;
        Some(Cow::Borrowed(&found.text))
    }
}

/// A program, as far as it is known.
#[derive(Clone, Copy)]
pub struct KnownProgram<'a> {
    /// The image; empty if it is not known.
    pub image: &'a [u8],
    /// The number profile of the image.
    pub profile: NumberProfile,
    /// Names, texts and places.
    pub symbols: Option<&'a Symbols>,
    pub sources: &'a dyn SourceTexts,
}

/// No texts.
struct NoSources;

impl SourceTexts for NoSources {
    fn source(&self, _: u32) -> Option<Cow<'_, str>> {
        None
    }
}

impl<'a> KnownProgram<'a> {
    /// A program of which nothing is known.
    pub const UNKNOWN: KnownProgram<'static> = KnownProgram {
        image: &[],
        profile: NumberProfile::Full,
        symbols: None,
        sources: &NoSources,
    };

    /// Returns the text of a constant string, if it is known.
    pub(crate) fn string(&self, number: u16) -> Option<&'a str> {
        match self.symbols {
            Some(symbols) => symbols.string(number),
            None => builtin::STRINGS.get(usize::from(number)).copied(),
        }
    }
}
