//! A table of a file.

use std::ops::{Range, RangeInclusive};

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::entry::TomlEntry;
use crate::error::{self, Cause, TomlError};
use crate::place::{Place, SourceText};
use crate::reader::{Override, Reader};

/// A table of the file and its place. A function that returns `None` for an existing value has
/// recorded the mistake.
pub struct Section<'a, C> {
    /// The state of the pass, which records mistakes.
    pub reader: &'a Reader<'a, C>,
    source: &'a SourceText<'a>,
    /// The name of the section in messages, such as `[world]`.
    pub name: &'static str,
    path: String,
    span: Range<usize>,
    /// `None` if only overrides mention the table.
    table: Option<&'a DeTable<'a>>,
}

impl<'a, C: Cause> Section<'a, C> {
    pub(crate) fn root(
        reader: &'a Reader<'a, C>,
        source: &'a SourceText<'a>,
        name: &'static str,
        table: &'a DeTable<'a>,
    ) -> Self {
        Section::new(reader, source, name, String::new(), 0..0, Some(table))
    }

    /// Returns a section. Records the keys of the table that a section of that name does not have.
    pub(crate) fn new(
        reader: &'a Reader<'a, C>,
        source: &'a SourceText<'a>,
        name: &'static str,
        path: String,
        span: Range<usize>,
        table: Option<&'a DeTable<'a>>,
    ) -> Self {
        let section = Section { reader, source, name, path, span, table };
        let known = (reader.schema)(name);
        let cause = |key: &str| TomlError::UnknownKey {
            key: key.to_owned(),
            section: name,
            known: known.clone(),
        };
        for key in section.unknown_keys(&known) {
            let place = || Some(source.place(key.span()));
            reader.note(cause(key.get_ref()), place);
        }
        for (key, set) in section.overrides() {
            if !known.contains(&key) {
                let place = || Some(set.source.place(0..set.source.text.len()));
                reader.note(cause(key), place);
            }
        }
        section
    }

    /// Returns the keys of the table that the section does not have, in the order of the file.
    fn unknown_keys(&self, known: &[&'static str]) -> Vec<&'a Spanned<toml::de::DeString<'a>>> {
        let keys = self.table.iter().flat_map(|table| table.keys());
        let mut unknown: Vec<_> =
            keys.filter(|key| !known.contains(&key.get_ref().as_ref())).collect();
        unknown.sort_by_key(|key| key.span().start);
        unknown
    }

    /// Records a mistake at this table.
    pub fn fail(&self, cause: impl Into<C>) {
        self.reader.note(cause, || Some(self.place()));
    }

    /// Returns the place of the table, for messages about it later.
    pub fn place(&self) -> Place {
        self.source.place(self.span.clone())
    }

    fn path_of(&self, key: &str) -> String {
        if self.path.is_empty() { key.to_owned() } else { format!("{}.{key}", self.path) }
    }

    /// Returns the overrides below this table: the next word of each path, and the override.
    fn overrides(&self) -> impl Iterator<Item = (&'a str, &'a Override<'a>)> {
        self.reader.overrides.iter().filter_map(|set| {
            let rest = match self.path.as_str() {
                "" => set.key,
                path => set.key.strip_prefix(path)?.strip_prefix('.')?,
            };
            Some((first_word(rest), set))
        })
    }

    /// Returns the value of a key, if it is there.
    pub fn get(&self, key: &str) -> Option<TomlEntry<'a, C>> {
        let path = self.path_of(key);
        let set = self.reader.overrides.iter().rev().find(|set| set.key == path);
        let (source, value): (_, &'a Spanned<DeValue<'a>>) = match set {
            Some(set) => (&set.source, &set.value),
            None => (self.source, self.table?.get(key)?),
        };
        Some(TomlEntry {
            reader: self.reader,
            source,
            key: key.to_owned(),
            path,
            span: value.span(),
            value: value.get_ref(),
        })
    }

    /// Returns the value of a key that must be there.
    pub fn required(&self, key: &'static str) -> Option<TomlEntry<'a, C>> {
        let entry = self.get(key);
        if entry.is_none() && !self.is_misspelled(key) {
            self.fail(TomlError::MissingKey { key, section: self.name });
        }
        entry
    }

    /// Returns true if an unknown key, which is already recorded, is probably a misspelling of this
    /// one.
    fn is_misspelled(&self, key: &'static str) -> bool {
        let known = (self.reader.schema)(self.name);
        let mut unknown = self.unknown_keys(&known).into_iter();
        unknown.any(|unknown| error::nearest_name(unknown.get_ref(), &known) == Some(key))
    }

    /// Returns the number of a key, if it is there ([`TomlEntry::number`]).
    pub fn number(&self, key: &str, range: RangeInclusive<f64>) -> Option<f64> {
        self.get(key)?.number(range)
    }

    /// Returns the integer of a key, if it is there ([`TomlEntry::integer`]).
    pub fn integer(&self, key: &str, range: RangeInclusive<u32>) -> Option<u32> {
        self.get(key)?.integer(range)
    }

    /// Returns the truth value of a key, if it is there ([`TomlEntry::boolean`]).
    pub fn boolean(&self, key: &str) -> Option<bool> {
        self.get(key)?.boolean()
    }

    /// Returns the meaning of the key's word in a list of words.
    pub fn word<T: Copy>(&self, key: &str, words: &[(&'static str, T)]) -> Option<T> {
        self.get(key)?.word(words)
    }

    /// Returns the one of several keys that exists. Two of them are a mistake, and so is none.
    pub fn one_of(
        &self,
        keys: &'static [&'static str],
    ) -> Option<(&'static str, TomlEntry<'a, C>)> {
        let mut found: Option<(&'static str, TomlEntry<'a, C>)> = None;
        for key in keys.iter().copied() {
            let Some(entry) = self.get(key) else { continue };
            match &found {
                Some((other, _)) => entry.fail(TomlError::Both { key, other }),
                None => found = Some((key, entry)),
            }
        }
        if found.is_none() {
            self.fail(TomlError::NoneOf { section: self.name, keys });
        }
        found
    }

    /// Returns a table inside this one, if it is in the file or in an override.
    pub fn section(&self, key: &str, name: &'static str) -> Option<Section<'a, C>> {
        if let Some(entry) = self.get(key) {
            return entry.section(name);
        }
        let is_set = self.overrides().any(|(word, _)| word == key);
        let (path, span) = (self.path_of(key), self.span.clone());
        is_set.then(|| Section::new(self.reader, self.source, name, path, span, None))
    }

    /// Returns the values of a table whose keys the format does not know, in the order of the file.
    /// An override replaces the value of its key; those of other keys come last.
    pub fn free_table(&self, key: &str) -> Vec<TomlEntry<'a, C>> {
        let path = self.path_of(key);
        let mut entries: Vec<TomlEntry<'a, C>> = Vec::new();
        if let Some(entry) = self.get(key) {
            let DeValue::Table(table) = entry.value else {
                entry.wrong_type("a table");
                return entries;
            };
            entries.extend(table.iter().map(|(name, value)| TomlEntry {
                reader: entry.reader,
                source: entry.source,
                key: name.get_ref().to_string(),
                path: format!("{path}.{}", name.get_ref()),
                span: value.span(),
                value: value.get_ref(),
            }));
            entries.sort_by_key(|entry| entry.span.start);
        }
        for set in self.reader.overrides {
            let name = set.key.strip_prefix(&path).and_then(|rest| rest.strip_prefix('.'));
            let Some(name) = name else { continue };
            let entry = TomlEntry {
                reader: self.reader,
                source: &set.source,
                key: name.to_owned(),
                path: set.key.to_owned(),
                span: set.value.span(),
                value: set.value.get_ref(),
            };
            match entries.iter_mut().find(|known| known.key == name) {
                Some(known) => *known = entry,
                None => entries.push(entry),
            }
        }
        entries
    }

    /// Returns the tables that are written as `[[key]]`.
    pub fn sections(&self, key: &str, name: &'static str) -> Vec<Section<'a, C>> {
        let items = self.get(key).and_then(|entry| entry.list()).unwrap_or_default();
        let below = self.path_of(key);
        for set in self.reader.overrides {
            let Some(rest) = set.key.strip_prefix(&below).and_then(|rest| rest.strip_prefix('.'))
            else {
                continue;
            };
            let word = first_word(rest);
            if word.parse::<usize>().ok().is_none_or(|index| index >= items.len()) {
                let cause =
                    TomlError::NoSuchEntry { path: format!("{below}.{word}"), count: items.len() };
                let place = || Some(set.source.place(0..set.source.text.len()));
                self.reader.note(cause, place);
            }
        }
        items.iter().filter_map(|item| item.section(name)).collect()
    }
}

/// Returns the path of a key up to its first dot.
fn first_word(path: &str) -> &str {
    path.split_once('.').map_or(path, |(first, _)| first)
}
