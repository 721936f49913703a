//! Formats calls of programs as shell commands.

use std::ffi::OsStr;
use std::process::Command;

/// Returns program and arguments, quoted if necessary.
pub fn line(call: &Command) -> String {
    words([call.get_program()].into_iter().chain(call.get_args()))
}

/// Returns the words of a command, quoted if necessary.
pub fn words(words: impl Iterator<Item: AsRef<OsStr>>) -> String {
    words.map(|word| quoted(word.as_ref())).collect::<Vec<_>>().join(" ")
}

/// Returns a word of a command, quoted if necessary.
pub fn quoted(word: &OsStr) -> String {
    let word = word.to_string_lossy();
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=:,+".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.into_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}
