//! A value of a file.

use std::ops::{Range, RangeInclusive};

use toml::Spanned;
use toml::de::DeValue;

use crate::error::{Cause, TomlError};
use crate::place::{Place, SourceText};
use crate::reader::Reader;
use crate::section::Section;

/// A value of the file, its key and its place. A function that returns `None` has recorded the
/// mistake.
pub struct TomlEntry<'a, C> {
    /// The state of the pass, which records mistakes.
    pub reader: &'a Reader<'a, C>,
    pub(crate) source: &'a SourceText<'a>,
    /// The key; for an element of a list, the key of the list.
    pub key: String,
    /// The path of the value in overrides.
    pub(crate) path: String,
    pub(crate) span: Range<usize>,
    /// The value from the TOML parser.
    pub value: &'a DeValue<'a>,
}

impl<C> Clone for TomlEntry<'_, C> {
    fn clone(&self) -> Self {
        let (key, path) = (self.key.clone(), self.path.clone());
        TomlEntry { key, path, span: self.span.clone(), ..*self }
    }
}

impl<'a, C: Cause> TomlEntry<'a, C> {
    /// Records a mistake at this value.
    pub fn fail(&self, cause: impl Into<C>) {
        self.reader.note(cause, || Some(self.place()));
    }

    /// Records a mistake at a part of this string, given in bytes of its content.
    pub fn fail_within(&self, part: Range<usize>, cause: impl Into<C>) {
        // With escapes or triple quotes, the place of the part is unknown, and the place is that of
        // the whole string.
        let inner = self.span.start + 1..self.span.end.saturating_sub(1);
        let is_plain = self.source.text.get(inner.clone()) == self.value.as_str();
        let span = match is_plain {
            true => inner.start + part.start..inner.start + part.end,
            false => self.span.clone(),
        };
        self.reader.note(cause, || Some(self.source.place(span)));
    }

    /// Returns the place of the value, for messages about it later.
    pub fn place(&self) -> Place {
        self.source.place(self.span.clone())
    }

    /// Returns the text of the value, as it stands in the file.
    pub fn text(&self) -> &'a str {
        self.source.text.get(self.span.clone()).unwrap_or_default()
    }

    /// Records that the value has another type than the key takes.
    pub fn wrong_type(&self, expected: &'static str) {
        let found = match self.value {
            DeValue::String(_) => "a string",
            DeValue::Integer(_) => "an integer",
            DeValue::Float(_) => "a float",
            DeValue::Boolean(_) => "true or false",
            DeValue::Datetime(_) => "a date",
            DeValue::Array(_) => "a list",
            DeValue::Table(_) => "a table",
        };
        self.fail(TomlError::WrongType { key: self.key.clone(), expected, found });
    }

    /// Returns the string. Any other type is a mistake.
    pub fn string(&self) -> Option<&'a str> {
        let DeValue::String(text) = self.value else {
            self.wrong_type("a string");
            return None;
        };
        Some(text)
    }

    /// Returns the truth value. Any other type is a mistake.
    pub fn boolean(&self) -> Option<bool> {
        let DeValue::Boolean(value) = self.value else {
            self.wrong_type("true or false");
            return None;
        };
        Some(*value)
    }

    /// Returns the meaning of the word in a list of words.
    pub fn word<T: Copy>(&self, words: &[(&'static str, T)]) -> Option<T> {
        let text = self.string()?;
        let found = words.iter().find(|(word, _)| *word == text);
        if found.is_none() {
            let known = words.iter().map(|(word, _)| (*word).to_owned()).collect();
            let (key, word) = (self.key.clone(), text.to_owned());
            self.fail(TomlError::UnknownWord { key, word, known });
        }
        found.map(|(_, meaning)| *meaning)
    }

    /// Returns the number, an integer or a float in any range.
    fn any_number(&self) -> Option<f64> {
        match self.value {
            DeValue::Integer(number) => {
                i64::from_str_radix(number.as_str(), number.radix()).ok().map(|value| value as f64)
            }
            DeValue::Float(number) => number.as_str().parse().ok(),
            _ => None,
        }
    }

    /// Returns the number, an integer or a float. A number out of the range is a mistake.
    pub fn number(&self, range: RangeInclusive<f64>) -> Option<f64> {
        let Some(value) = self.any_number() else {
            self.wrong_type("a number");
            return None;
        };
        if range.contains(&value) {
            return Some(value);
        }
        // The largest float is not a limit that a person would understand.
        let bound = |bound: &f64| (bound.abs() < f64::MAX).then(|| number_text(*bound));
        let range = match (bound(range.start()), bound(range.end())) {
            (Some(start), Some(end)) => format!("a number from {start} to {end}"),
            (Some(start), None) => format!("a number from {start} on"),
            _ => "a number that is finite".to_owned(),
        };
        let (key, value) = (self.key.clone(), number_text(value));
        self.fail(TomlError::OutOfRange { key, value, range });
        None
    }

    /// Returns the integer. A float or an integer out of the range is a mistake.
    pub fn integer(&self, range: RangeInclusive<u32>) -> Option<u32> {
        let DeValue::Integer(number) = self.value else {
            self.wrong_type("an integer");
            return None;
        };
        match u32::from_str_radix(number.as_str(), number.radix()) {
            Ok(value) if range.contains(&value) => Some(value),
            _ => {
                let range = format!("a whole number from {} to {}", range.start(), range.end());
                let (key, value) = (self.key.clone(), number.to_string());
                self.fail(TomlError::OutOfRange { key, value, range });
                None
            }
        }
    }

    /// Returns the elements of a list.
    pub fn list(&self) -> Option<Vec<TomlEntry<'a, C>>> {
        let DeValue::Array(items) = self.value else {
            self.wrong_type("a list");
            return None;
        };
        let entry = |(index, item): (usize, &'a Spanned<DeValue<'a>>)| TomlEntry {
            key: self.key.clone(),
            path: format!("{}.{index}", self.path),
            span: item.span(),
            value: item.get_ref(),
            ..*self
        };
        Some(items.iter().enumerate().map(entry).collect())
    }

    /// Returns a list of `N` numbers.
    pub fn numbers<const N: usize>(
        &self,
        expected: &'static str,
        range: RangeInclusive<f64>,
    ) -> Option<[f64; N]> {
        let DeValue::Array(items) = self.value else {
            self.wrong_type(expected);
            return None;
        };
        if items.len() != N {
            let (key, found) = (self.key.clone(), items.len());
            self.fail(TomlError::Length { key, expected, found });
            return None;
        }
        let mut numbers = [0.0; N];
        for (number, item) in numbers.iter_mut().zip(&self.list()?) {
            *number = item.number(range.clone())?;
        }
        Some(numbers)
    }

    /// Returns the table, and records the keys that a section of that name does not have.
    pub fn section(&self, name: &'static str) -> Option<Section<'a, C>> {
        let DeValue::Table(table) = self.value else {
            self.wrong_type("a table");
            return None;
        };
        let path = self.path.clone();
        Some(Section::new(self.reader, self.source, name, path, self.span.clone(), Some(table)))
    }
}

/// Returns the text of a number for messages, with a power of ten instead of hundreds of digits.
pub fn number_text(number: f64) -> String {
    let size = number.abs();
    if number.is_finite() && number != 0.0 && !(1e-6..1e15).contains(&size) {
        return format!("{number:e}");
    }
    number.to_string()
}
