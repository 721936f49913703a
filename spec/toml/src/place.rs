//! Places in a text, for messages.

use std::ops::Range;

/// The longest part of a line that a place shows, in bytes. Generated files have lines of megabytes.
const EXCERPT_BYTES_MAX: usize = 400;

/// Bytes before the place that an excerpt of a long line shows.
const BEFORE: usize = 100;

#[cfg(test)]
thread_local! {
    /// The bytes that were read to find places, for the test that long files take linear time.
    pub(crate) static BYTES_READ: std::cell::Cell<usize> = const { std::cell::Cell::new(0) };
}

/// A range of characters in a line of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// Path of the file as it was given.
    pub path: String,
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// Number of characters; at least 1.
    pub width: usize,
    /// The text of the line, or the part around the place if the line is long.
    pub source: String,
    /// Column of the first character of `source`: 1 unless the line is long.
    pub source_column: usize,
}

/// A text with its name in messages.
#[derive(Debug)]
pub struct SourceText<'a> {
    /// Path of the file as it was given, or another name.
    pub path: &'a str,
    /// The whole text.
    pub text: &'a str,
    /// The byte at which each line begins.
    lines: Vec<usize>,
}

impl<'a> SourceText<'a> {
    /// Finds the lines of `text`, so that [`place`](Self::place) need not search the whole text.
    pub fn new(path: &'a str, text: &'a str) -> Self {
        let newlines = text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n');
        let lines = std::iter::once(0).chain(newlines.map(|(at, _)| at + 1)).collect();
        SourceText { path, text, lines }
    }

    /// Returns the place of a range of bytes. A range outside of the text stands for the end of the
    /// text.
    pub fn place(&self, span: Range<usize>) -> Place {
        let at = self.boundary_before(span.start);
        let line = self.lines.partition_point(|start| *start <= at);
        // The first line starts at 0, so the count is at least 1.
        let line_start = self.lines[line - 1];
        let line_end = self.lines.get(line).map_or(self.text.len(), |next| next - 1);
        let line_end = match self.text[line_start..line_end].ends_with('\r') {
            true => line_end - 1,
            false => line_end,
        };
        let end = self.boundary_before(span.end.clamp(at, line_end.max(at)));
        let (from, to) = match line_end - line_start {
            0..=EXCERPT_BYTES_MAX => (line_start, line_end),
            _ => {
                let from = self.boundary_before(at.saturating_sub(BEFORE).max(line_start));
                (from, self.boundary_before(line_end.min(from + EXCERPT_BYTES_MAX)))
            }
        };
        let count = |range: Range<usize>| {
            #[cfg(test)]
            BYTES_READ.set(BYTES_READ.get() + range.len());
            self.text[range].chars().count()
        };
        Place {
            path: self.path.to_owned(),
            line,
            column: count(line_start..at) + 1,
            width: count(at..end).max(1),
            source: self.text[from..to].to_owned(),
            source_column: count(line_start..from) + 1,
        }
    }

    /// Returns the nearest boundary of a character at or before that byte.
    fn boundary_before(&self, at: usize) -> usize {
        self.text.floor_char_boundary(at)
    }
}
