//! Formats calls of other programs as shell commands.

use std::ffi::OsStr;
use std::process::Command;

/// Returns program and arguments, quoted if necessary.
pub fn line(call: &Command) -> String {
    let words = [call.get_program()].into_iter().chain(call.get_args());
    words.map(quoted).collect::<Vec<_>>().join(" ")
}

fn quoted(word: &OsStr) -> String {
    let word = word.to_string_lossy();
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=:,+".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.into_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}
