//! Changes to the words of a text.

use std::ops::Range;

/// Words of scripts.
#[rustfmt::skip]
pub const SCRIPTS: &[&str] = &[
    "(", ")", "{", "}", "[", "]", ",", ".", "=", "==", "!=", "<", "+", "-", "*", "/", "%", "^", "&", "|", "!",
    "<<", ">>", " and ", " or ", " not ", " nil ", " self ", "\nvar ", "\nif(", " else ", "\nwhile(",
    "\nfor(", "\nfunction ", " function(", "\nreturn ", "\n", ";", "#", "\"", "'", "0", "1", "-1", "40000",
    "0.5", "1e9", "x", "t", "math", "foreach", "log", "swarm", "include ", "\"vec2.bzz\"",
];

/// Words of scenarios, robot files and symbols.
#[rustfmt::skip]
pub const FILES: &[&str] = &[
    "[", "]", "[[", "]]", "{", "}", "=", ":", ",", ".", "\"", "'", "\n", "#", "0", "1", "-1", "255", "256", "65536",
    "4294967296", "1e308", "1e-308", "inf", "nan", "0.5", "true", "null", "\"\"", "[]", "{}", "robots", "world",
    "event", "expect", "medium", "light", "obstacle", "at", "count", "group", "body", "name", "function", "vm",
    "format", "lines", "strings", "\u{e9}", "\\",
];

/// A text as words with the blanks between them.
pub fn split(text: &str) -> Vec<&str> {
    let mut words = Vec::new();
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let is_name = |c: char| c.is_alphanumeric() || c == '_';
        let end = if is_name(first) {
            rest.find(|c| !is_name(c)).unwrap_or(rest.len())
        } else {
            first.len_utf8()
        };
        let (word, after) = rest.split_at(end);
        words.push(word);
        rest = after;
    }
    words
}

/// Makes one change: `kind` says which, `at` where, `value` what with. `known` are words that the text may lack.
pub fn change<'t>(words: &mut Vec<&'t str>, known: &[&'t str], kind: u8, at: u8, value: u8) {
    if words.is_empty() {
        return;
    }
    // A byte reaches all of a short script and every few words of a long one.
    let at = usize::from(at) * words.len() / 256;
    let other = usize::from(value) * words.len() / 256;
    match kind % 16 {
        // Names for names, numbers for numbers, operators for operators.
        0..6 => {
            let like = class(words[at]);
            let mut from_there = words[other..].iter().chain(&words[..other]);
            if let Some(word) = from_there.find(|word| class(word) == like && **word != words[at]) {
                words[at] = word;
            }
        }
        6 | 7 => words[at] = known[usize::from(value) % known.len()],
        8 | 9 => {
            let copied = words[line(words, other)].to_vec();
            let start = line(words, at).start;
            words.splice(start..start, copied);
        }
        10 | 11 => {
            words.drain(line(words, at));
        }
        12 => words[at] = words[other],
        13 => words.swap(at, other),
        14 => words.insert(at, words[other]),
        _ => {
            words.remove(at);
        }
    }
}

/// The line that a word stands in, often a statement, up to its end.
fn line(words: &[&str], at: usize) -> Range<usize> {
    let start = words[..at].iter().rposition(|word| *word == "\n").map_or(0, |end| end + 1);
    let end = words[at..].iter().position(|word| *word == "\n");
    start..end.map_or(words.len(), |end| at + end + 1)
}

fn class(word: &str) -> u8 {
    match word.as_bytes().first() {
        Some(b'a'..=b'z' | b'A'..=b'Z' | b'_') => b'a',
        Some(b'0'..=b'9') => b'0',
        Some(b'+' | b'-' | b'*' | b'/' | b'%' | b'^' | b'&' | b'|') => b'+',
        Some(b'=' | b'<' | b'>' | b'!') => b'=',
        Some(first) => *first,
        None => 0,
    }
}
