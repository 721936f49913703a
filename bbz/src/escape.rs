//! The filter of everything that this program prints: text of others does not control the terminal.

use std::borrow::Cow;
use std::fmt::Write;

/// Returns true for a character that controls a terminal or turns the direction of text: C0 but line breaks
/// and tabs, DEL, C1, and the controls of Unicode Standard Annex 9.
fn is_control(c: char) -> bool {
    match c {
        '\n' | '\t' => false,
        '\u{61c}' | '\u{200e}' | '\u{200f}' => true,
        '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' => true,
        _ => c.is_control(),
    }
}

/// Returns a text whose controls are written as `\u001b`. This is the notation of JSON, so that strings of
/// objects keep their characters.
pub fn escaped(text: &str) -> Cow<'_, str> {
    if !text.contains(is_control) {
        return Cow::Borrowed(text);
    }
    let mut result = String::with_capacity(text.len());
    let mut characters = text.chars().peekable();
    while let Some(c) = characters.next() {
        // Tables have the line breaks of RFC 4180.
        let is_break = c == '\r' && characters.peek() == Some(&'\n');
        match is_control(c) && !is_break {
            true => {
                let _ = write!(result, "\\u{:04x}", u32::from(c));
            }
            false => result.push(c),
        }
    }
    Cow::Owned(result)
}

/// Returns the colored form of a text, or the escaped one without colors if the text has a control.
pub fn colored<'a>(plain: &'a str, colored: impl FnOnce() -> String) -> Cow<'a, str> {
    match escaped(plain) {
        Cow::Borrowed(_) => Cow::Owned(colored()),
        escaped => escaped,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn controls_are_escaped_and_all_else_stays() {
        let kept = "Grüße, 世界 \u{1f916}\ta\r\nb\n";
        assert_eq!(escaped(kept), kept);
        assert_eq!(escaped("\u{1b}[2J\r\u{7f}"), "\\u001b[2J\\u000d\\u007f");
        assert_eq!(escaped("\u{9b}31m \u{202e}txt"), "\\u009b31m \\u202etxt");
    }

    #[test]
    fn strings_of_objects_keep_their_characters() {
        let all: String = (0..0x3000).filter_map(char::from_u32).collect();
        let text = serde_json::json!({ "all": all }).to_string();
        let printed = escaped(&text);
        assert!(!printed.contains(is_control));
        let read: serde_json::Value = serde_json::from_str(&printed).unwrap();
        assert_eq!(read["all"], *all);
    }
}
