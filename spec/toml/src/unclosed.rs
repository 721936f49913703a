//! Finds a bracket that is never closed. The parser takes everything after it as its content, and
//! reports a mistake in each line that follows.

/// A bracket or brace that is never closed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Unclosed {
    /// Byte offset in the text.
    pub at: usize,
    /// `[` or `{`.
    pub open: char,
    /// `]` or `}`.
    pub close: char,
}

/// Returns the first bracket or brace of a TOML text that is never closed. Brackets in strings and
/// comments do not count.
pub fn find(text: &str) -> Option<Unclosed> {
    let mut open: Vec<Unclosed> = Vec::new();
    let mut at = 0;
    while let Some(c) = text.get(at..)?.chars().next() {
        let rest = &text[at..];
        match c {
            '#' => at += rest.find('\n').unwrap_or(rest.len()),
            '"' | '\'' => at += string_length(rest, c),
            '[' | '{' => {
                let close = if c == '[' { ']' } else { '}' };
                open.push(Unclosed { at, open: c, close });
                at += 1;
            }
            ']' | '}' => {
                match open.pop() {
                    // It closes an outer bracket, so the inner one is never closed.
                    Some(inner) if inner.close != c => return Some(inner),
                    _ => {}
                }
                at += 1;
            }
            _ => at += c.len_utf8(),
        }
    }
    open.first().copied()
}

/// Returns the length in bytes of the string at the beginning of a text. A string on a single line
/// ends with the line at the latest.
fn string_length(text: &str, quote: char) -> usize {
    let triple = quote.to_string().repeat(3);
    let is_multiline = text.starts_with(&triple);
    let mark = if is_multiline { triple.as_str() } else { &triple[..1] };
    let mut at = mark.len();
    while let Some(c) = text[at..].chars().next() {
        if text[at..].starts_with(mark) {
            return at + mark.len();
        }
        match c {
            '\n' if !is_multiline => return at,
            // Only a basic string has escapes.
            '\\' if quote == '"' => {
                let escaped = text[at + 1..].chars().next().map_or(0, char::len_utf8);
                at += 1 + escaped;
            }
            _ => at += c.len_utf8(),
        }
    }
    at
}
