//! The characters that no text of others may bring to a terminal.

/// Returns C0 without those that end a line, DEL, C1, and the controls of direction (Unicode
/// Standard Annex 9).
pub fn controls() -> String {
    let c0 = (1..0x20).filter(|code| !matches!(code, 9 | 10 | 13));
    let c1 = 0x7f..0xa0;
    let direction =
        [0x61c, 0x200e, 0x200f].into_iter().chain(0x202a..=0x202e).chain(0x2066..=0x2069);
    c0.chain(c1).chain(direction).filter_map(char::from_u32).collect()
}

/// Returns sequences that clear the terminal and set its title, then all controls.
pub fn hostile() -> String {
    format!("\u{1b}[2J\u{1b}]0;owned\u{7}\u{9b}31m{}", controls())
}

/// Returns the text with escapes of TOML and JSON, for strings that cannot hold all controls as they
/// are.
pub fn escaped(text: &str) -> String {
    text.chars().map(|c| format!("\\u{:04x}", u32::from(c))).collect()
}

/// Returns the first control in a text. A carriage return is one unless it belongs to a line break,
/// as in tables.
pub fn found_in(text: &str) -> Option<char> {
    let controls = controls();
    let mut characters = text.chars().peekable();
    while let Some(c) = characters.next() {
        let is_stray_return = c == '\r' && characters.peek() != Some(&'\n');
        if c == '\0' || is_stray_return || controls.contains(c) {
            return Some(c);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn controls_are_found() {
        assert_eq!(found_in("Gr\u{fc}\u{df}e\ta\r\nb\n"), None);
        for c in ['\0', '\u{1b}', '\u{7f}', '\u{9b}', '\u{202e}', '\u{2066}', '\r'] {
            assert_eq!(found_in(&format!("a{c}b")), Some(c));
        }
    }
}
