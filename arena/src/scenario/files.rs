//! `[[file]]`: files that stand in the scenario itself, so that it runs from any folder.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::fmt::Write;
use std::iter;
use std::ops::Range;
use std::path::{Path, PathBuf};

use bittybuzz_compiler::include::{Files, MemoryFiles, OverlaidFiles};
use toml::de::{DeTable, DeValue};

use super::error::ScenarioCause;
use super::keys::FILE;
use super::read::Section;

/// The files of a scenario's `[[file]]` sections. They take the place of files on disk with the
/// same paths.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct EmbeddedFiles {
    /// Their paths begin with the folder of the scenario.
    files: MemoryFiles,
    /// The folder of the scenario.
    folder: PathBuf,
}

impl EmbeddedFiles {
    /// Returns these files over others.
    pub fn over<'a>(&'a self, below: &'a dyn Files) -> OverlaidFiles<'a> {
        OverlaidFiles { over: &self.files, below }
    }

    /// Returns the text of the file at a path.
    pub fn text(&self, path: &Path) -> Option<String> {
        let bytes = self.files.read(path, usize::MAX).ok()?;
        Some(String::from_utf8(bytes).expect("a string of TOML is UTF-8"))
    }

    /// Returns true if the file at a path is one of these.
    pub fn contains(&self, path: &Path) -> bool {
        self.files.contains(path)
    }

    /// Returns the folder in which includes are searched in addition: that of the scenario, if it
    /// has files. A file that `-I` has found stands there under the name of its include.
    pub fn include_folder(&self) -> Option<&Path> {
        (!self.files.is_empty()).then_some(&*self.folder)
    }
}

/// Reads the sections. `folder` is that of the scenario.
pub fn read(root: &Section<'_>, folder: &Path) -> EmbeddedFiles {
    let mut embedded = EmbeddedFiles { folder: folder.to_owned(), ..EmbeddedFiles::default() };
    let mut lines: BTreeMap<PathBuf, usize> = BTreeMap::new();
    for section in root.sections("file", FILE) {
        let path = section.required("path");
        let text = section.required("text").and_then(|entry| entry.string());
        let (Some(entry), Some(text)) = (path, text) else { continue };
        let Some(name) = entry.string() else { continue };
        let path = folder.join(name);
        match lines.entry(path.clone()) {
            Entry::Occupied(line) => {
                let (path, line) = (name.to_owned(), *line.get());
                entry.fail(ScenarioCause::DuplicateFile { path, line });
                continue;
            }
            Entry::Vacant(free) => free.insert(entry.place().line),
        };
        embedded.files = std::mem::take(&mut embedded.files).with(path, text);
    }
    embedded
}

/// Returns the text of a scenario without its `[[file]]` sections. A text that is not TOML stays
/// as it is.
pub fn without_files(text: &str) -> String {
    let Ok(document) = DeTable::parse(text) else { return text.to_owned() };
    let Some((key, value)) = document.get_ref().get_key_value("file") else {
        return text.to_owned();
    };
    let DeValue::Array(items) = value.get_ref() else { return text.to_owned() };
    let is_section = |span: &Range<usize>| text[span.clone()].starts_with("[[");
    let sections: Vec<Range<usize>> = match items.iter().all(|item| is_section(&item.span())) {
        true => items
            .iter()
            .map(|item| item.span().start..end(item.get_ref(), item.span().end))
            .collect(),
        // The list is the value of a key.
        false => iter::once(key.span().start..value.span().end).collect(),
    };
    let mut rest = String::new();
    let mut kept = 0;
    for section in sections {
        let before = text[kept..section.start].trim_end();
        if !before.is_empty() {
            rest.push_str(before);
            rest.push('\n');
        }
        // A comment after the last value belongs to it.
        kept = text[section.end..].find('\n').map_or(text.len(), |at| section.end + at + 1);
    }
    rest.push_str(&text[kept..]);
    rest.trim_end().to_owned() + "\n"
}

/// Returns the end of the last value of a table; `least` for a table without values.
fn end(value: &DeValue<'_>, least: usize) -> usize {
    let DeValue::Table(table) = value else { return least };
    table.values().map(|value| value.span().end).max().unwrap_or(least)
}

/// Returns files as `[[file]]` sections.
pub fn sections<'a>(files: impl Iterator<Item = (&'a str, &'a str)>) -> String {
    let mut text = String::new();
    for (path, content) in files {
        let (path, content) = (basic(path), multi_line(content));
        let _ = write!(text, "\n[[file]]\npath = {path}\ntext = {content}\n");
    }
    text
}

/// Returns a string of one line in TOML.
fn basic(text: &str) -> String {
    format!("\"{}\"", escaped(text).replace('\n', "\\n"))
}

/// Returns a string of several lines in TOML. Texts of scripts stand there as they are; others,
/// which are rare, need escapes.
fn multi_line(text: &str) -> String {
    let is_control = |c: char| c.is_control() && c != '\n' && c != '\t';
    match text.contains("'''") || text.ends_with('\'') || text.contains(is_control) {
        false => format!("'''\n{text}'''"),
        true => format!("\"\"\"\n{}\"\"\"", escaped(text)),
    }
}

/// Escapes all characters but line feeds that a basic string of TOML cannot contain.
fn escaped(text: &str) -> String {
    let mut escaped = String::new();
    for c in text.chars() {
        match c {
            '\\' | '"' => escaped.extend(['\\', c]),
            '\n' => escaped.push(c),
            _ if c.is_control() => {
                let _ = write!(escaped, "\\u{:04X}", u32::from(c));
            }
            _ => escaped.push(c),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEAD: &str = "# A world.\n[world]\nsize = [1, 1]\n";

    /// Returns the value of a key of the first section.
    fn parsed(text: &str, key: &str) -> String {
        let document = DeTable::parse(text).unwrap();
        let files = document.get_ref()["file"].get_ref().as_array().unwrap();
        files[0].get_ref().as_table().unwrap()[key].get_ref().as_str().unwrap().to_owned()
    }

    #[test]
    fn every_text_comes_back() {
        for text in [
            "",
            "\n",
            "\n\nfunction step() { led(1) }\n",
            "no line feed",
            "log('one') # '''\n",
            "ends with '",
            "\"\"\" and \\ and \\u0041\n",
            "\ttab\r\nline\rfeed\u{1}\u{7f}\u{9b} ü\n",
        ] {
            let written = sections([("a \"b\"\\c.bzz", text)].into_iter());
            assert_eq!(parsed(&written, "text"), text, "{written}");
            assert_eq!(parsed(&written, "path"), "a \"b\"\\c.bzz", "{written}");
        }
    }

    #[test]
    fn sections_are_left_out() {
        let files = [("a.bzz", "[[file]]\npath = \"x\"\n"), ("b.bzz", "'''\n")];
        let written = sections(files.into_iter());
        assert_eq!(without_files(HEAD), HEAD);
        assert_eq!(without_files(&format!("{HEAD}{written}")), HEAD);
        let tail = "\n[output]\nevery = 2\n";
        let between = format!("{HEAD}{written}{tail}");
        assert_eq!(without_files(&between), format!("{HEAD}{tail}"));
        let listed = format!("file = [{{ path = \"a\", text = \"b\" }}] # one\n{HEAD}");
        assert_eq!(without_files(&listed), HEAD);
        assert_eq!(without_files("[[file]\n"), "[[file]\n");
    }
}
