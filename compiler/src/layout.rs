//! Lines and columns of a text. The layout is computed once, and then a place costs the same however
//! long its line is: every message and every instruction has some.

/// Bytes from one known number of characters to the next.
const BLOCK: usize = 64;

/// A position for people. Lines and columns count from 1, and columns count characters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LineColumn {
    pub line: u32,
    pub column: u32,
}

/// The layout of a text.
#[derive(Debug, Clone)]
pub struct Layout {
    /// The offsets of its lines.
    line_starts: Vec<usize>,
    /// The number of characters that begin before each block of bytes; empty if the text is ASCII.
    characters: Vec<usize>,
}

impl Layout {
    pub fn new(text: &str) -> Self {
        let after_newlines = text.match_indices('\n').map(|(at, _)| at + 1);
        let mut characters = Vec::new();
        if !text.is_ascii() {
            let mut before = 0;
            for block in text.as_bytes().chunks(BLOCK) {
                characters.push(before);
                before += begun(block);
            }
            characters.push(before);
        }
        Layout { line_starts: std::iter::once(0).chain(after_newlines).collect(), characters }
    }

    /// Returns the offset of a line, counted from 0.
    pub fn line_start(&self, line: usize) -> Option<usize> {
        self.line_starts.get(line).copied()
    }

    /// Returns the line, counted from 0, that contains the byte at `offset`.
    pub fn line_of(&self, offset: usize) -> usize {
        // The first line starts at 0, so the count is at least 1.
        self.line_starts.partition_point(|start| *start <= offset) - 1
    }

    /// Returns the place of a byte of the text, which begins a character or ends the text.
    pub fn line_column(&self, text: &str, offset: usize) -> LineColumn {
        let line = self.line_of(offset);
        let before = |offset| self.characters_before(text.as_bytes(), offset);
        let column = before(offset) - before(self.line_starts[line]);
        LineColumn { line: line as u32 + 1, column: column as u32 + 1 }
    }

    fn characters_before(&self, bytes: &[u8], offset: usize) -> usize {
        match self.characters.get(offset / BLOCK) {
            Some(before) => before + begun(&bytes[offset - offset % BLOCK..offset]),
            None => offset,
        }
    }
}

/// Returns the number of characters that begin in these bytes of UTF-8.
fn begun(bytes: &[u8]) -> usize {
    bytes.iter().filter(|byte| **byte & 0xc0 != 0x80).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_those_that_counting_gives() {
        let words = ["", "a", "\n", "é\n", "世界", "\u{1f916}", "0123456789", "ß\n\n"];
        for seed in 0..words.len() {
            let text: String = (0..300).map(|i| words[(i * i + seed) % words.len()]).collect();
            let ascii = "x = 1\n".repeat(seed) + &"y".repeat(200);
            for text in [text, ascii] {
                let layout = Layout::new(&text);
                let ends = text.char_indices().map(|(at, _)| at).chain([text.len()]);
                for at in ends {
                    let before = &text[..at];
                    let start = before.rfind('\n').map_or(0, |newline| newline + 1);
                    let expected = LineColumn {
                        line: before.matches('\n').count() as u32 + 1,
                        column: before[start..].chars().count() as u32 + 1,
                    };
                    assert_eq!(layout.line_column(&text, at), expected, "{text:?} {at}");
                }
            }
        }
    }
}
