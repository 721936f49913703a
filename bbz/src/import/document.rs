//! The XML of an experiment, read as ARGoS reads it, with the place of each mistake.
//!
//! A reading function records a mistake and returns `None`; its caller continues, so that one run
//! finds all mistakes.

use std::cell::RefCell;
use std::iter;
use std::ops::Range;

use bittybuzz_toml_reader::{Place, SourceText};
use roxmltree::{Document, Error as XmlError, Node};

use super::mistake::{Allowed, Mistake};
use super::omission::Omissions;

/// The largest number of mistakes that are kept.
const MISTAKES_MAX: usize = 100;

/// The longest name of a thing and the longest path, in bytes.
const NAME_BYTES_MAX: usize = 1000;

/// The longest text that a message repeats, in characters.
const SHOWN_MAX: usize = 60;

/// A file with the mistakes and omissions that were found in it.
pub struct Reader<'a> {
    source: SourceText<'a>,
    /// The byte at which each line begins, so that the line of a byte is found in little time even if
    /// the whole file is one line.
    lines: Vec<usize>,
    mistakes: RefCell<Vec<(Mistake, Place)>>,
    omissions: RefCell<Omissions>,
}

impl<'a> Reader<'a> {
    pub fn new(path: &'a str, text: &'a str) -> Self {
        let newlines = text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n');
        Reader {
            source: SourceText::new(path, text),
            lines: iter::once(0).chain(newlines.map(|(at, _)| at + 1)).collect(),
            mistakes: RefCell::default(),
            omissions: RefCell::default(),
        }
    }

    /// Parses the text, and records a mistake if it is not XML.
    pub fn document(&self) -> Option<Document<'a>> {
        // Without document types a file cannot define entities, which could expand to gigabytes.
        let document = Document::parse(self.source.text);
        let error = match document {
            Ok(document) => return Some(document),
            Err(error) => error,
        };
        let at = self.place_of(&error);
        let message = error.to_string().replace(&format!(" at {}", error.pos()), "");
        self.fail(Mistake::from_xml(&error, message), at..at);
        None
    }

    /// Returns the byte at which the text stops to be XML.
    fn place_of(&self, error: &XmlError) -> usize {
        let text = self.source.text;
        match error {
            // These have no position in the error.
            XmlError::DtdDetected => text.find("<!DOCTYPE").unwrap_or(0),
            XmlError::UnclosedRootNode | XmlError::UnexpectedEndOfStream => text.trim_end().len(),
            _ => {
                let position = error.pos();
                let start = self.lines.get(position.row as usize - 1).copied().unwrap_or(0);
                let mut characters = text[start..].char_indices();
                let character = characters.nth(position.col as usize - 1);
                character.map_or(text.len(), |(at, _)| start + at)
            }
        }
    }

    fn fail(&self, mistake: Mistake, span: Range<usize>) {
        let mut mistakes = self.mistakes.borrow_mut();
        if mistakes.len() < MISTAKES_MAX {
            mistakes.push((mistake, self.source.place(span)));
        }
    }

    /// Returns the mistakes in the order of the file.
    pub fn into_results(self) -> (Vec<(Mistake, Place)>, Omissions) {
        let mut mistakes = self.mistakes.into_inner();
        mistakes.sort_by_key(|(_, place)| (place.line, place.column));
        (mistakes, self.omissions.into_inner())
    }
}

/// An element of the file.
#[derive(Clone, Copy)]
pub struct Element<'a> {
    node: Node<'a, 'a>,
    reader: &'a Reader<'a>,
}

impl<'a> Element<'a> {
    /// Returns the root of a document.
    pub fn root(document: &'a Document<'a>, reader: &'a Reader<'a>) -> Self {
        Element { node: document.root_element(), reader }
    }

    pub fn name(self) -> &'a str {
        self.node.tag_name().name()
    }

    /// Returns a number that no other element of the document has.
    pub fn key(self) -> usize {
        self.node.range().start
    }

    pub fn line(self) -> usize {
        let start = self.key();
        self.reader.lines.partition_point(|line| *line <= start)
    }

    fn span(self) -> Range<usize> {
        let start = self.key();
        // The angle bracket and the name.
        start..start + 1 + self.name().len()
    }

    pub fn elements(self) -> impl Iterator<Item = Element<'a>> {
        let nodes = self.node.children().filter(Node::is_element);
        nodes.map(move |node| Element { node, reader: self.reader })
    }

    pub fn all(self, name: &str) -> impl Iterator<Item = Element<'a>> {
        self.elements().filter(move |element| element.name() == name)
    }

    /// Returns the first element of that name: ARGoS ignores the others.
    pub fn first(self, name: &str) -> Option<Element<'a>> {
        self.all(name).next()
    }

    /// Returns the first element of that name, which ARGoS requires.
    pub fn required(self, name: &'static str) -> Option<Element<'a>> {
        let found = self.first(name);
        if found.is_none() {
            self.fail(Mistake::NoElement { element: self.name().to_owned(), missing: name });
        }
        found
    }

    /// Records a mistake of this element.
    pub fn fail(self, mistake: Mistake) {
        self.reader.fail(mistake, self.span());
    }

    /// Records a mistake of an attribute.
    pub fn fail_at(self, attribute: &str, mistake: Mistake) {
        let span = self.node.attribute_node(attribute).map(|found| found.range());
        self.reader.fail(mistake, span.unwrap_or(self.span()));
    }

    /// Records a thing that the scenario lacks or has in another form, and the cure.
    pub fn omit(self, text: impl Into<String>, cure: impl Into<String>) {
        self.omit_in(self.line(), text, cure);
    }

    /// Records such a thing in another line.
    pub fn omit_in(self, line: usize, text: impl Into<String>, cure: impl Into<String>) {
        self.reader.omissions.borrow_mut().add(line, text.into(), cure.into());
    }

    pub fn text(self, attribute: &str) -> Option<&'a str> {
        self.node.attribute(attribute)
    }

    pub fn attributes(self) -> impl Iterator<Item = (&'a str, &'a str)> {
        self.node.attributes().map(|attribute| (attribute.name(), attribute.value()))
    }

    /// Returns an attribute that other parts of the file repeat, so that its length is limited.
    pub fn name_in(self, attribute: &'static str) -> Option<&'a str> {
        let text = self.text(attribute)?;
        if text.len() > NAME_BYTES_MAX {
            self.fail_at(attribute, Mistake::TooLong { attribute, most: NAME_BYTES_MAX });
            return None;
        }
        Some(text)
    }

    pub fn required_name(self, attribute: &'static str) -> Option<&'a str> {
        self.required_text(attribute)?;
        self.name_in(attribute)
    }

    /// Returns an attribute that ARGoS requires.
    pub fn required_text(self, attribute: &'static str) -> Option<&'a str> {
        let text = self.text(attribute);
        if text.is_none() {
            self.fail(Mistake::NoAttribute { element: self.name().to_owned(), attribute });
        }
        text
    }

    /// Returns the number of an attribute. A missing attribute is no mistake.
    pub fn number(self, attribute: &'static str, allowed: Allowed) -> Option<f64> {
        let text = self.text(attribute)?;
        let (number, rest) = self.leading_number(attribute, text)?;
        if !rest.trim().is_empty() {
            self.omit_rest(attribute, text, &number.to_string());
        }
        self.allow(attribute, number, allowed)
    }

    /// Returns the number of an attribute, or `default` without the attribute; `None` after a mistake.
    pub fn number_or(self, attribute: &'static str, allowed: Allowed, default: f64) -> Option<f64> {
        self.optional_number(attribute, allowed).map(|number| number.unwrap_or(default))
    }

    /// Returns the number of an attribute, or `Some(None)` without the attribute; `None` after a
    /// mistake.
    pub fn optional_number(self, attribute: &'static str, allowed: Allowed) -> Option<Option<f64>> {
        match self.text(attribute) {
            Some(_) => self.number(attribute, allowed).map(Some),
            None => Some(None),
        }
    }

    pub fn required_number(self, attribute: &'static str, allowed: Allowed) -> Option<f64> {
        self.required_text(attribute)?;
        self.number(attribute, allowed)
    }

    /// Returns the three numbers of an attribute, separated by commas.
    pub fn vector(self, attribute: &'static str, allowed: Allowed) -> Option<[f64; 3]> {
        let text = self.text(attribute)?;
        let parts: Vec<&str> = text.split(',').collect();
        let [x, y, z, further @ ..] = parts.as_slice() else {
            self.fail_at(attribute, Mistake::TooFew { attribute, found: parts.len() });
            return None;
        };
        let mut is_whole = further.is_empty();
        let mut vector = [0.0; 3];
        for (number, part) in vector.iter_mut().zip([x, y, z]) {
            let (read, rest) = self.leading_number(attribute, part)?;
            is_whole &= rest.trim().is_empty();
            *number = self.allow(attribute, read, allowed)?;
        }
        if !is_whole {
            self.omit_rest(attribute, text, &vector.map(|number| number.to_string()).join(","));
        }
        Some(vector)
    }

    /// Returns the numbers of an attribute, or zeros without the attribute; `None` after a mistake.
    pub fn vector_or_zero(self, attribute: &'static str) -> Option<[f64; 3]> {
        match self.text(attribute) {
            Some(_) => self.vector(attribute, Allowed::Any),
            None => Some([0.0; 3]),
        }
    }

    pub fn required_vector(self, attribute: &'static str, allowed: Allowed) -> Option<[f64; 3]> {
        self.required_text(attribute)?;
        self.vector(attribute, allowed)
    }

    /// Returns the number at the start of a text, and the text after it.
    fn leading_number<'t>(self, attribute: &'static str, text: &'t str) -> Option<(f64, &'t str)> {
        let found = leading_number(text).filter(|(number, _)| number.is_finite());
        if found.is_none() {
            self.fail_at(attribute, Mistake::NoNumber { attribute, text: shown(text.trim()) });
        }
        found
    }

    fn allow(self, attribute: &'static str, number: f64, allowed: Allowed) -> Option<f64> {
        if allowed.contains(number) {
            return Some(number);
        }
        self.fail_at(attribute, Mistake::OutOfRange { attribute, number, allowed });
        None
    }

    /// C++ reads a number up to the first character that does not belong to it, without an error.
    fn omit_rest(self, attribute: &str, text: &str, read: &str) {
        self.omit(
            format!("`{attribute}` is \"{text}\", of which ARGoS reads {read}"),
            "the same is read here; correct the text",
        );
    }
}

/// Returns the beginning of a text, for a message.
pub fn shown(text: &str) -> String {
    match text.char_indices().nth(SHOWN_MAX) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text.to_owned(),
    }
}

/// Returns the decimal number at the start of a text, as the streams of C++ read it, and the text
/// after it.
fn leading_number(text: &str) -> Option<(f64, &str)> {
    let text = text.trim_start();
    let digits = |from: usize| text[from..].bytes().take_while(u8::is_ascii_digit).count();
    let sign = |from: usize| usize::from(text[from..].starts_with(['+', '-']));
    let mut end = sign(0);
    let mut count = digits(end);
    end += count;
    if text[end..].starts_with('.') {
        let fraction = digits(end + 1);
        count += fraction;
        end += 1 + fraction;
    }
    if count == 0 {
        return None;
    }
    if text[end..].starts_with(['e', 'E']) {
        let start = end + 1 + sign(end + 1);
        let exponent = digits(start);
        if exponent > 0 {
            end = start + exponent;
        }
    }
    Some((text[..end].parse().ok()?, &text[end..]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_end_where_c_plus_plus_ends_them() {
        for (text, number, rest) in [
            ("0.8.0", 0.8, ".0"),
            (" .1", 0.1, ""),
            ("5.", 5.0, ""),
            ("-2e-1x", -0.2, "x"),
            ("+3m", 3.0, "m"),
            ("1e", 1.0, "e"),
            ("12\u{e4}", 12.0, "\u{e4}"),
        ] {
            assert_eq!(leading_number(text), Some((number, rest)), "{text}");
        }
        for text in ["", "-", ".", "e5", "inf", "nan", "x1", "@N@"] {
            assert_eq!(leading_number(text), None, "{text}");
        }
    }
}
