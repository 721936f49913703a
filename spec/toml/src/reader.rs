//! One pass over a file, and the mistakes that are found in it.

use std::cell::RefCell;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::error::{Cause, FileError, MISTAKES_MAX, TomlError};
use crate::place::{Place, SourceText};
use crate::section::Section;
use crate::unclosed::{self, Unclosed};

/// A function that returns the keys that a section may have, by the name of the section in
/// messages.
pub type Schema<'a> = &'a dyn Fn(&'static str) -> Vec<&'static str>;

/// A value that replaces one of the file, such as that of `--set medium.ir.loss=0.1`.
#[derive(Debug)]
pub struct Override<'a> {
    /// The path of the key: `medium.ir.loss`.
    pub key: &'a str,
    /// The text of the value.
    pub source: SourceText<'a>,
    /// The parsed value.
    pub value: Spanned<DeValue<'a>>,
}

impl<'a> Override<'a> {
    /// Parses the text of a value. A text that is not TOML is taken as a string, so that words need
    /// no quotes.
    pub fn new(key: &'a str, source: SourceText<'a>) -> Self {
        let text = source.text;
        let value = DeValue::parse(text)
            .unwrap_or_else(|_| Spanned::new(0..text.len(), DeValue::String(text.into())));
        Override { key, source, value }
    }
}

/// The state that all sections and entries of a file share.
pub struct Reader<'a, C> {
    pub(crate) overrides: &'a [Override<'a>],
    pub(crate) schema: Schema<'a>,
    mistakes: RefCell<Mistakes<C>>,
}

struct Mistakes<C> {
    kept: Vec<FileError<C>>,
    more: usize,
}

/// Reads a file: calls `format` with its root section, named `root`. The mistakes are in the order
/// of the file. Those in overrides and other files come last.
pub fn read<T, C: Cause>(
    source: &SourceText<'_>,
    overrides: &[Override<'_>],
    (root, schema): (&'static str, Schema<'_>),
    format: impl FnOnce(&Section<'_, C>) -> Option<T>,
) -> Result<T, Vec<FileError<C>>> {
    let mistakes = RefCell::new(Mistakes { kept: Vec::new(), more: 0 });
    let reader = Reader { overrides, schema, mistakes };
    let (document, syntax) = DeTable::parse_recoverable(source.text);
    let unclosed = if syntax.is_empty() { None } else { unclosed::find(source.text) };
    for mistake in &syntax {
        let span = mistake.span().unwrap_or(0..0);
        // Mistakes after an unclosed bracket are only its consequences.
        if unclosed.is_none_or(|unclosed| span.start < unclosed.at) {
            let cause = TomlError::Syntax { message: mistake.message().to_owned() };
            reader.note(cause, || Some(source.place(span)));
        }
    }
    if let Some(Unclosed { at, open, close }) = unclosed {
        reader.note(TomlError::Unclosed { open, close }, || Some(source.place(at..at + 1)));
    }
    let value = match syntax.is_empty() {
        true => format(&Section::root(&reader, source, root, document.get_ref())),
        // A file with a syntax error would only give misleading errors.
        false => None,
    };
    let Mistakes { kept: mut errors, more } = reader.mistakes.into_inner();
    errors.sort_by_key(|error| {
        error.place.as_ref().map(|place| (place.path != source.path, place.line, place.column))
    });
    if more > 0 {
        errors.push(FileError { cause: TomlError::More { count: more }.into(), place: None });
    }
    match value {
        Some(value) if errors.is_empty() => Ok(value),
        _ => Err(errors),
    }
}

impl<C: Cause> Reader<'_, C> {
    /// Records a mistake at a place, which may be in another file.
    pub fn fail_at(&self, place: &Place, cause: impl Into<C>) {
        self.note(cause, || Some(place.clone()));
    }

    /// Returns true if further mistakes are only counted, so that the caller need not build an
    /// expensive cause.
    pub fn is_full(&self) -> bool {
        self.mistakes.borrow().kept.len() >= MISTAKES_MAX
    }

    pub(crate) fn note(&self, cause: impl Into<C>, place: impl FnOnce() -> Option<Place>) {
        if self.is_full() {
            self.mistakes.borrow_mut().more += 1;
        } else {
            self.keep(FileError { cause: cause.into(), place: place().map(Box::new) });
        }
    }

    fn keep(&self, mistake: FileError<C>) {
        let kept = &mut self.mistakes.borrow_mut().kept;
        // A value may be read twice, but its mistake is reported once.
        let is_known = |known: &FileError<C>| {
            known.place == mistake.place && known.cause.to_string() == mistake.cause.to_string()
        };
        if !kept.iter().any(is_known) {
            kept.push(mistake);
        }
    }
}
