//! Reading TOML so that every mistake is found in one run: a value that is wrong is noted, and a harmless one stands in
//! for it.

use std::cell::RefCell;
use std::ops::{Range, RangeInclusive};

use bittybuzz_robots::Place;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::error::{Cause, ScenarioError};
use super::keys;

/// A text in which values stand: the file, or the value of a `--set`.
#[derive(Clone, Copy)]
pub struct Source<'a> {
    pub path: &'a str,
    pub text: &'a str,
}

/// A value of `--set`, which takes the place of the file's.
pub struct Override<'a> {
    /// `medium.ir.loss`
    pub key: &'a str,
    pub source: Source<'a>,
    pub value: Spanned<DeValue<'a>>,
}

/// What all readers share.
pub struct Reader<'a> {
    pub overrides: &'a [Override<'a>],
    pub errors: RefCell<Vec<ScenarioError>>,
}

impl Reader<'_> {
    pub fn fail(&self, source: Source<'_>, span: Range<usize>, cause: Cause) {
        self.fail_at(&Place::new(source.path, source.text, span), cause);
    }

    pub fn fail_at(&self, place: &Place, cause: Cause) {
        let place = Some(Box::new(place.clone()));
        self.errors.borrow_mut().push(ScenarioError { cause, place });
    }
}

/// A value of the file, its key and where it stands.
#[derive(Clone)]
pub struct Entry<'a> {
    pub reader: &'a Reader<'a>,
    source: Source<'a>,
    pub key: String,
    /// As `--set` would name it.
    path: String,
    span: Range<usize>,
    pub value: &'a DeValue<'a>,
}

impl<'a> Entry<'a> {
    pub fn fail(&self, cause: Cause) {
        self.reader.fail(self.source, self.span.clone(), cause);
    }

    pub fn place(&self) -> Place {
        Place::new(self.source.path, self.source.text, self.span.clone())
    }

    /// Notes that the value has another type than the key takes.
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
        self.fail(Cause::WrongType { key: self.key.clone(), expected, found });
    }

    pub fn string(&self) -> Option<&'a str> {
        let DeValue::String(text) = self.value else {
            self.wrong_type("a string");
            return None;
        };
        Some(text)
    }

    /// The number, integer or float, whatever its range.
    pub fn any_number(&self) -> Option<f64> {
        match self.value {
            DeValue::Integer(number) => {
                i64::from_str_radix(number.as_str(), number.radix()).ok().map(|value| value as f64)
            }
            DeValue::Float(number) => number.as_str().parse().ok(),
            _ => None,
        }
    }

    pub fn number(&self, range: RangeInclusive<f64>) -> Option<f64> {
        let Some(value) = self.any_number() else {
            self.wrong_type("a number");
            return None;
        };
        if range.contains(&value) {
            return Some(value);
        }
        let (start, end) = (range.start(), range.end());
        let range = match (start.is_finite(), end.is_finite()) {
            (true, true) => format!("a number from {start} to {end}"),
            (true, false) => format!("a number from {start} on"),
            _ => "a number that is finite".to_owned(),
        };
        self.fail(Cause::OutOfRange { key: self.key.clone(), value: value.to_string(), range });
        None
    }

    pub fn integer(&self, range: RangeInclusive<u32>) -> Option<u32> {
        let DeValue::Integer(number) = self.value else {
            self.wrong_type("an integer");
            return None;
        };
        match u32::from_str_radix(number.as_str(), number.radix()) {
            Ok(value) if range.contains(&value) => Some(value),
            _ => {
                let range = format!("a whole number from {} to {}", range.start(), range.end());
                let value = number.to_string();
                self.fail(Cause::OutOfRange { key: self.key.clone(), value, range });
                None
            }
        }
    }

    /// The elements of a list.
    pub fn list(&self) -> Option<Vec<Entry<'a>>> {
        let DeValue::Array(items) = self.value else {
            self.wrong_type("a list");
            return None;
        };
        let entry = |(index, item): (usize, &'a Spanned<DeValue<'a>>)| Entry {
            reader: self.reader,
            source: self.source,
            key: self.key.clone(),
            path: format!("{}.{index}", self.path),
            span: item.span(),
            value: item.get_ref(),
        };
        Some(items.iter().enumerate().map(entry).collect())
    }

    /// A list of `N` numbers.
    pub fn numbers<const N: usize>(
        &self,
        expected: &'static str,
        range: RangeInclusive<f64>,
    ) -> Option<[f64; N]> {
        let DeValue::Array(_) = self.value else {
            self.wrong_type(expected);
            return None;
        };
        let items = self.list()?;
        let Ok(items) = <[Entry<'a>; N]>::try_from(items.clone()) else {
            self.fail(Cause::Length { key: self.key.clone(), expected, found: items.len() });
            return None;
        };
        let mut numbers = [0.0; N];
        for (number, item) in numbers.iter_mut().zip(&items) {
            *number = item.number(range.clone())?;
        }
        Some(numbers)
    }

    pub fn section(&self, name: &'static str) -> Option<Section<'a>> {
        let DeValue::Table(table) = self.value else {
            self.wrong_type("a table");
            return None;
        };
        let section = Section {
            reader: self.reader,
            source: self.source,
            name,
            path: self.path.clone(),
            span: self.span.clone(),
            table: Some(table),
        };
        section.only_known();
        Some(section)
    }
}

/// A table of the file and where it stands.
#[derive(Clone)]
pub struct Section<'a> {
    pub reader: &'a Reader<'a>,
    source: Source<'a>,
    pub name: &'static str,
    path: String,
    span: Range<usize>,
    /// `None` if only `--set` speaks of it.
    table: Option<&'a DeTable<'a>>,
}

impl<'a> Section<'a> {
    pub fn root(reader: &'a Reader<'a>, source: Source<'a>, table: &'a DeTable<'a>) -> Self {
        let path = String::new();
        let section =
            Section { reader, source, name: keys::ROOT, path, span: 0..0, table: Some(table) };
        section.only_known();
        section
    }

    pub fn fail(&self, cause: Cause) {
        self.reader.fail(self.source, self.span.clone(), cause);
    }

    pub fn place(&self) -> Place {
        Place::new(self.source.path, self.source.text, self.span.clone())
    }

    fn path_of(&self, key: &str) -> String {
        if self.path.is_empty() { key.to_owned() } else { format!("{}.{key}", self.path) }
    }

    /// What `--set` says below this table: the next word of each path, and the value.
    fn set_here(&self) -> impl Iterator<Item = (&'a str, &'a Override<'a>)> {
        let overrides = self.reader.overrides.iter();
        overrides.filter_map(|set| {
            let rest = match self.path.as_str() {
                "" => set.key,
                path => set.key.strip_prefix(path)?.strip_prefix('.')?,
            };
            Some((rest.split('.').next().unwrap_or(rest), set))
        })
    }

    /// Notes keys that the section does not have.
    fn only_known(&self) {
        let known = keys::of(self.name);
        let unknown = |key: &str| !known.contains(&key);
        let cause = |key: &str| Cause::UnknownKey {
            key: key.to_owned(),
            section: self.name.to_owned(),
            known: known.clone(),
        };
        let mut keys: Vec<_> = self.table.iter().flat_map(|table| table.keys()).collect();
        keys.sort_by_key(|key| key.span().start);
        for key in keys {
            if unknown(key.get_ref()) {
                self.reader.fail(self.source, key.span(), cause(key.get_ref()));
            }
        }
        for (key, set) in self.set_here() {
            if unknown(key) {
                self.reader.fail(set.source, 0..set.source.text.len(), cause(key));
            }
        }
    }

    pub fn get(&self, key: &str) -> Option<Entry<'a>> {
        let path = self.path_of(key);
        let set = self.reader.overrides.iter().rev().find(|set| set.key == path);
        let (source, value) = match set {
            Some(set) => (set.source, &set.value),
            None => (self.source, self.table?.get(key)?),
        };
        Some(Entry {
            reader: self.reader,
            source,
            key: key.to_owned(),
            path,
            span: value.span(),
            value: value.get_ref(),
        })
    }

    /// The value of a key that must be there.
    pub fn required(&self, key: &'static str) -> Option<Entry<'a>> {
        let entry = self.get(key);
        if entry.is_none() {
            self.fail(Cause::MissingKey { key, section: self.name.to_owned() });
        }
        entry
    }

    pub fn number(&self, key: &str, range: RangeInclusive<f64>) -> Option<f64> {
        self.get(key)?.number(range)
    }

    pub fn integer(&self, key: &str, range: RangeInclusive<u32>) -> Option<u32> {
        self.get(key)?.integer(range)
    }

    pub fn boolean(&self, key: &str) -> Option<bool> {
        let entry = self.get(key)?;
        let DeValue::Boolean(value) = entry.value else {
            entry.wrong_type("true or false");
            return None;
        };
        Some(*value)
    }

    /// A word out of a list, with what it stands for.
    pub fn word<T: Copy>(&self, key: &'static str, words: &[(&'static str, T)]) -> Option<T> {
        let entry = self.get(key)?;
        let text = entry.string()?;
        let found = words.iter().find(|(word, _)| *word == text);
        if found.is_none() {
            let known = words.iter().map(|(word, _)| (*word).to_owned()).collect();
            entry.fail(Cause::UnknownWord { key, word: text.to_owned(), known });
        }
        found.map(|(_, meaning)| *meaning)
    }

    /// The one of several keys that is there. Two are a mistake, and so is none.
    pub fn one_of(&self, keys: &'static [&'static str]) -> Option<(&'static str, Entry<'a>)> {
        let mut found: Option<(&'static str, Entry<'a>)> = None;
        for key in keys.iter().copied() {
            let Some(entry) = self.get(key) else { continue };
            match &found {
                Some((other, _)) => entry.fail(Cause::Both { key, other }),
                None => found = Some((key, entry)),
            }
        }
        if found.is_none() {
            self.fail(Cause::NoneOf { section: self.name.to_owned(), keys });
        }
        found
    }

    /// A table inside this one. Without one in file and `--set` there is none.
    pub fn section(&self, key: &str, name: &'static str) -> Option<Section<'a>> {
        if let Some(entry) = self.get(key) {
            return entry.section(name);
        }
        let is_set = self.set_here().any(|(word, _)| word == key);
        is_set.then(|| {
            let path = self.path_of(key);
            let Section { reader, source, .. } = *self;
            let section =
                Section { reader, source, name, path, span: self.span.clone(), table: None };
            section.only_known();
            section
        })
    }

    /// Tables that are written as `[[key]]`.
    pub fn sections(&self, key: &'static str, name: &'static str) -> Vec<Section<'a>> {
        let items = self.get(key).and_then(|entry| entry.list()).unwrap_or_default();
        let below = self.path_of(key);
        for set in self.reader.overrides {
            let Some(rest) = set.key.strip_prefix(&below).and_then(|rest| rest.strip_prefix('.'))
            else {
                continue;
            };
            let word = rest.split('.').next().unwrap_or(rest);
            if word.parse::<usize>().ok().is_none_or(|index| index >= items.len()) {
                let path = format!("{below}.{word}");
                let cause = Cause::NoSuchEntry { path, count: items.len() };
                self.reader.fail(set.source, 0..set.source.text.len(), cause);
            }
        }
        items.iter().filter_map(|item| item.section(name)).collect()
    }
}
