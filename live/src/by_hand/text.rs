//! Changes of a TOML text at the places of its values. All other bytes of the text stay.
//!
//! A comment on a line that is removed as a whole goes with the line; all other comments stay.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// The longest line that an addition makes, in bytes.
pub const LINE_MAX: usize = 100;

/// Changes of a text, which do not overlap.
#[derive(Debug, Default)]
pub struct TextChanges(Vec<(Range<usize>, String)>);

impl TextChanges {
    pub fn replace(&mut self, range: Range<usize>, with: impl Into<String>) {
        self.0.push((range, with.into()));
    }

    pub fn insert(&mut self, at: usize, added: impl Into<String>) {
        self.replace(at..at, added);
    }

    /// Returns the text with all changes. Several insertions at one place keep their order.
    pub fn apply(mut self, text: &str) -> String {
        self.0.sort_by_key(|(range, _)| (range.start, range.end));
        let (mut changed, mut done) = (String::new(), 0);
        for (range, with) in self.0 {
            changed += &text[done..range.start];
            changed += &with;
            done = range.end;
        }
        changed + &text[done..]
    }
}

/// A value of the text, or an element of a list.
pub type Item<'a> = Spanned<DeValue<'a>>;

/// Formats a length or an angle: at most two decimals.
pub fn number_text(value: f64) -> String {
    // The sum turns -0 into 0.
    ((value * 100.0).round() / 100.0 + 0.0).to_string()
}

/// Formats a list of numbers.
pub fn numbers_text(values: &[f64]) -> String {
    let texts: Vec<String> = values.iter().map(|value| number_text(*value)).collect();
    format!("[{}]", texts.join(", "))
}

/// Returns the number of a value, if it is one.
pub fn number(item: &Item<'_>) -> Option<f64> {
    match item.get_ref() {
        DeValue::Integer(number) => {
            i64::from_str_radix(number.as_str(), number.radix()).ok().map(|value| value as f64)
        }
        DeValue::Float(number) => number.as_str().parse().ok(),
        _ => None,
    }
}

/// Returns the elements of a list, or of a sequence of sections `[[key]]`.
pub fn elements<'a>(item: &'a Item<'a>) -> &'a [Item<'a>] {
    match item.get_ref() {
        DeValue::Array(items) => items,
        _ => &[],
    }
}

/// Replaces a number, unless it has this value as it is.
pub fn set_number(changes: &mut TextChanges, item: &Item<'_>, value: f64) {
    let text = number_text(value);
    if number(item).map(number_text).as_ref() != Some(&text) {
        changes.replace(item.span(), text);
    }
}

/// Replaces the numbers of a list that have other values.
pub fn set_numbers(changes: &mut TextChanges, item: &Item<'_>, values: &[f64]) {
    for (item, value) in elements(item).iter().zip(values) {
        set_number(changes, item, *value);
    }
}

/// The notations of a table.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Notation {
    /// `[table]` or `[[table]]`, with a key on each line below.
    Section,
    /// `{ key = value }`.
    Inline,
    /// `table.key = value`.
    Dotted,
}

/// A table of the text.
#[derive(Clone, Copy)]
pub struct TextTable<'a> {
    text: &'a str,
    item: &'a Item<'a>,
    pub table: &'a DeTable<'a>,
}

impl<'a> TextTable<'a> {
    /// Returns a value as a table, if it is one.
    pub fn new(text: &'a str, item: &'a Item<'a>) -> Option<Self> {
        match item.get_ref() {
            DeValue::Table(table) => Some(TextTable { text, item, table }),
            _ => None,
        }
    }

    fn notation(&self) -> Notation {
        match self.text[self.item.span()].as_bytes().first() {
            Some(b'[') => Notation::Section,
            Some(b'{') => Notation::Inline,
            _ => Notation::Dotted,
        }
    }

    /// Sets the value of a key that the table may not have yet. Returns false for a table without
    /// a header, to which no key can be added.
    pub fn set(&self, changes: &mut TextChanges, key: &str, value: &str) -> bool {
        if let Some(item) = self.table.get(key) {
            changes.replace(item.span(), value);
            return true;
        }
        let last = own_ends(self.table).max();
        match (self.notation(), last) {
            (Notation::Dotted, _) => return false,
            (Notation::Inline, Some(end)) => changes.insert(end, format!(", {key} = {value}")),
            (Notation::Inline, None) => {
                changes.replace(self.item.span(), format!("{{ {key} = {value} }}"));
            }
            (Notation::Section, last) => {
                let at = line_end(self.text, last.unwrap_or(self.item.span().end));
                changes.insert(at, format!("{}{key} = {value}", newline(self.text)));
            }
        }
        true
    }

    /// Sets the value of a key that the table does not have, in the place of other keys. Returns
    /// false for a table without a header.
    pub fn replace_keys(
        &self,
        changes: &mut TextChanges,
        replaced: &[&str],
        (key, value): (&str, &str),
    ) -> bool {
        let mut entries: Vec<(Range<usize>, bool)> = self
            .table
            .iter()
            .map(|(key, item)| {
                let is_replaced = replaced.contains(&key.get_ref().as_ref());
                (key.span().start..end_of(item), is_replaced)
            })
            .collect();
        if entries.iter().all(|(_, is_replaced)| !is_replaced) {
            return self.set(changes, key, value);
        }
        entries.sort_by_key(|(span, _)| span.start);
        let added = format!("{key} = {value}");
        if self.notation() == Notation::Inline {
            let is_kept = |(span, is_replaced): (Range<usize>, bool)| match is_replaced {
                true => None,
                false => Some(&self.text[span]),
            };
            let kept = entries.into_iter().filter_map(is_kept);
            let parts: Vec<&str> = kept.chain([&*added]).collect();
            changes.replace(self.item.span(), format!("{{ {} }}", parts.join(", ")));
            return true;
        }
        let mut lines = Some(added + newline(self.text));
        for (span, _) in entries.into_iter().filter(|(_, is_replaced)| *is_replaced) {
            let with = lines.take().unwrap_or_default();
            changes.replace(whole_lines(self.text, span), with);
        }
        true
    }
}

/// Returns the ends of the entries that stand below the header of a table, or in its braces.
fn own_ends(table: &DeTable<'_>) -> impl Iterator<Item = usize> {
    // The key of a section stands within its header.
    let own = table.iter().filter(|(key, item)| key.span().start <= item.span().start);
    own.map(|(_, item)| end_of(item))
}

/// Returns the end of a value: for a section, that of the last value in it.
pub fn end_of(item: &Item<'_>) -> usize {
    let own = item.span().end;
    match item.get_ref() {
        DeValue::Table(table) => table.values().map(end_of).fold(own, usize::max),
        DeValue::Array(items) => items.iter().map(end_of).fold(own, usize::max),
        _ => own,
    }
}

/// Returns the text of an element without its comments, which [`append`] takes. Elements have no
/// strings, so each `#` starts a comment.
pub fn element_text(text: &str, item: &Item<'_>) -> String {
    let lines = text[item.span().start..end_of(item)].split_inclusive('\n');
    let without = lines.filter_map(|line| match line.split_once('#') {
        None => Some(line.to_owned()),
        Some((before, _)) if before.trim().is_empty() => None,
        Some((before, comment)) => {
            let rest = comment.trim_end_matches(['\r', '\n']).len();
            Some(before.trim_end().to_owned() + &comment[rest..])
        }
    });
    without.collect()
}

/// Returns true for a section `[[key]]`.
fn is_section(text: &str, item: &Item<'_>) -> bool {
    matches!(item.get_ref(), DeValue::Table(_)) && text[item.span()].starts_with('[')
}

/// Appends an element to a list. `added` is the text of an inline value, or of a section if the list
/// is made of sections.
pub fn append(changes: &mut TextChanges, text: &str, list: &Item<'_>, added: &str) {
    let newline = newline(text);
    let Some(last) = elements(list).last() else {
        return changes.insert(list.span().start + 1, added);
    };
    if is_section(text, last) {
        let at = line_end(text, end_of(last));
        return changes.insert(at, format!("{newline}{newline}{added}"));
    }
    let end = last.span().end;
    let comma = comma_after(text, end);
    let has_own_line = line_end(text, comma.unwrap_or(end)) < list.span().end;
    let indent = indent_of(text, end);
    let is_long = end - line_start(text, end) + added.len() > LINE_MAX - 3;
    let is_alone = text[line_start(text, end)..last.span().start].trim().is_empty();
    if has_own_line && !is_alone && !is_long {
        // A line of a table of numbers is filled.
        changes.insert(end, format!(", {added}"));
    } else if has_own_line {
        if comma.is_none() {
            changes.insert(end, ",");
        }
        changes.insert(line_end(text, comma.unwrap_or(end)), format!("{newline}{indent}{added},"));
    } else {
        let comma_text = if comma.is_none() { "," } else { "" };
        let at = comma.unwrap_or(end);
        match is_long {
            true => changes.insert(at, format!("{comma_text}{newline}{indent}  {added}")),
            false => changes.insert(at, format!("{comma_text} {added}")),
        }
    }
}

/// Returns true if new elements of a list are sections `[[key]]`; then with the header of the last
/// one.
pub fn section_header<'a>(text: &'a str, list: &Item<'_>) -> Option<&'a str> {
    let last = elements(list).last().filter(|last| is_section(text, last))?;
    Some(&text[last.span()])
}

/// Removes an element of a list.
pub fn remove(changes: &mut TextChanges, text: &str, list: &Item<'_>, number: usize) {
    let items = elements(list);
    let item = &items[number];
    if is_section(text, item) {
        let lines = whole_lines(text, item.span().start..end_of(item));
        // The blank line after it goes, too, if there is one before it.
        let has_space = text[..lines.start].ends_with("\n\n") || lines.start == 0;
        let after = lines.end + blank_line(&text[lines.end..]).filter(|_| has_space).unwrap_or(0);
        return changes.replace(lines.start..after, "");
    }
    let span = item.span();
    let comma = comma_after(text, span.end);
    let end = comma.unwrap_or(span.end);
    let is_first_on_line = text[line_start(text, span.start)..span.start].trim().is_empty();
    let rest = text[end..line_end(text, end)].trim_start();
    if is_first_on_line && (rest.is_empty() || rest.starts_with('#')) {
        changes.replace(whole_lines(text, span.start..end), "");
    } else if comma.is_some() {
        let spaces = text[end..].len() - text[end..].trim_start_matches(' ').len();
        // The spaces before it stay if the line ends here.
        let spaces = if rest.is_empty() { 0 } else { spaces };
        changes.replace(span.start..end + spaces, "");
    } else {
        let before = number.checked_sub(1).map(|before| items[before].span().end);
        // A comma and spaces; a comment between the two elements stays.
        let from = before.filter(|from| text[*from..span.start].trim() == ",");
        changes.replace(from.unwrap_or(span.start)..span.end, "");
    }
}

/// Returns the place after the comma that follows a place, with only blanks and comments in between.
fn comma_after(text: &str, at: usize) -> Option<usize> {
    let mut rest = text[at..].trim_start();
    while rest.starts_with('#') {
        rest = rest.split_once('\n').map_or("", |(_, rest)| rest).trim_start();
    }
    rest.starts_with(',').then(|| text.len() - rest.len() + 1)
}

fn line_start(text: &str, at: usize) -> usize {
    text[..at].rfind('\n').map_or(0, |newline| newline + 1)
}

/// Returns the end of the line of a place, without the line break.
pub fn line_end(text: &str, at: usize) -> usize {
    let end = text[at..].find('\n').map_or(text.len(), |newline| at + newline);
    if text[at..end].ends_with('\r') { end - 1 } else { end }
}

/// Returns the lines of a range, with their line breaks.
fn whole_lines(text: &str, range: Range<usize>) -> Range<usize> {
    let end = text[range.end..].find('\n').map_or(text.len(), |newline| range.end + newline + 1);
    line_start(text, range.start)..end
}

/// Returns the length of the line break at the beginning of a text.
fn blank_line(text: &str) -> Option<usize> {
    ["\n", "\r\n"].into_iter().find(|newline| text.starts_with(newline)).map(str::len)
}

fn indent_of(text: &str, at: usize) -> &str {
    let line = &text[line_start(text, at)..at];
    &line[..line.len() - line.trim_start().len()]
}

/// Returns the line break that a text has.
pub fn newline(text: &str) -> &'static str {
    if text.contains("\r\n") { "\r\n" } else { "\n" }
}
