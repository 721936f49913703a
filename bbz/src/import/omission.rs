//! The list of everything that a scenario lacks, or has in another form than the experiment.

use std::collections::BTreeSet;
use std::fmt::Write;

/// The largest number of entries, and of lines that an entry names.
const ENTRIES_MAX: usize = 100;
const LINES_MAX: usize = 5;

/// The longest text in characters.
const TEXT_MAX: usize = 500;

/// The entries of a file. Those that differ only in their line are one entry.
#[derive(Debug, Default)]
pub struct Omissions {
    entries: Vec<Omission>,
    /// The number of further entries.
    further: usize,
}

#[derive(Debug)]
struct Omission {
    /// The lines of the experiment.
    lines: BTreeSet<usize>,
    text: String,
    cure: String,
}

impl Omissions {
    /// Adds an entry. Control characters, which an attribute may contain, do not reach the list, and
    /// long texts end with dots.
    pub fn add(&mut self, line: usize, text: String, cure: String) {
        let [text, cure] = [text, cure].map(printable);
        let is_full = self.entries.len() >= ENTRIES_MAX;
        let is_same = |entry: &&mut Omission| entry.text == text && entry.cure == cure;
        if let Some(entry) = self.entries.iter_mut().find(is_same) {
            entry.lines.insert(line);
        } else if is_full {
            self.further += 1;
        } else {
            self.entries.push(Omission { lines: BTreeSet::from([line]), text, cure });
        }
    }

    /// Returns a line for each entry, in the order of the file. `place` formats the first line of an
    /// entry.
    pub fn lines(&self, place: impl Fn(usize) -> String) -> Vec<String> {
        let mut entries: Vec<&Omission> = self.entries.iter().collect();
        entries.sort_by_key(|entry| entry.lines.first());
        let line = |entry: &Omission| {
            let mut lines = entry.lines.iter();
            let first = *lines.next().expect("an entry has the line with which it was added");
            let mut line = format!("{}: {}", place(first), entry.text);
            let others = lines.len();
            if others > 0 {
                let shown: Vec<String> = lines.take(LINES_MAX).map(usize::to_string).collect();
                let noun = if others == 1 { "line" } else { "lines" };
                let _ = write!(line, " (also {noun} {}", shown.join(", "));
                match others - shown.len() {
                    0 => line.push(')'),
                    more => {
                        let _ = write!(line, " and {more} more)");
                    }
                }
            }
            format!("{line}; {}", entry.cure)
        };
        let mut lines: Vec<String> = entries.into_iter().map(line).collect();
        match self.further {
            0 => {}
            1 => lines.push("1 more is not shown".to_owned()),
            further => lines.push(format!("{further} more are not shown")),
        }
        lines
    }
}

fn printable(text: String) -> String {
    let text = text.replace(char::is_control, "?");
    match text.char_indices().nth(TEXT_MAX) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_are_sorted_and_those_of_many_lines_are_one() {
        let mut omissions = Omissions::default();
        let mut add = |line, text: &str| omissions.add(line, text.to_owned(), "do it".to_owned());
        for line in [9, 9, 10, 11, 12, 13, 14, 15] {
            add(line, "many");
        }
        add(3, "one\nline");
        for line in [4, 5] {
            add(line, "two");
        }
        let lines = omissions.lines(|line| format!("f:{line}"));
        let expected = [
            "f:3: one?line; do it",
            "f:4: two (also line 5); do it",
            "f:9: many (also lines 10, 11, 12, 13, 14 and 1 more); do it",
        ];
        assert_eq!(lines, expected);
    }

    #[test]
    fn the_list_has_an_end() {
        let mut omissions = Omissions::default();
        (1..=102).for_each(|line| omissions.add(line, line.to_string(), String::new()));
        let lines = omissions.lines(|line| line.to_string());
        assert_eq!((lines.len(), lines[100].as_str()), (101, "2 more are not shown"));
    }
}
