//! Somebody who types a script sees the messages about each of its beginnings.

use std::fs;
use std::path::{Path, PathBuf};

use crate::machine::{FULL, build};

/// Codes of messages about a name that nothing defines.
const UNKNOWN: [&str; 5] = ["E0401", "E0402", "E0410", "W0201", "W0208"];

fn examples(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            found.extend(examples(&path));
        } else if path.extension().is_some_and(|extension| extension == "bzz") {
            found.push(path);
        }
    }
    found.sort();
    found
}

/// Returns true if the text, as a person reads it, defines the name in some function.
fn defines(text: &str, name: &str) -> bool {
    let is_part = |c: char| c.is_alphanumeric() || c == '_';
    text.match_indices(name).any(|(at, _)| {
        let (before, behind) = (&text[..at], &text[at + name.len()..]);
        if before.ends_with(is_part) || behind.starts_with(is_part) {
            return false;
        }
        let assigned =
            behind.trim_start().strip_prefix('=').is_some_and(|rest| !rest.starts_with('='));
        let declared = ["var", "function"].iter().any(|word| before.trim_end().ends_with(word));
        let head = before.rsplit(')').next().unwrap_or_default();
        let parameter = head.rsplit_once('(').is_some_and(|(callee, _)| {
            callee.contains("function")
                && !callee.rsplit("function").next().unwrap_or("").contains(['{', '}', ';'])
        });
        assigned || declared || parameter
    })
}

fn check(path: &Path, every: usize) {
    let text = fs::read_to_string(path).expect("a script");
    for (end, _) in text.char_indices().filter(|(end, _)| end % every == 0) {
        let beginning = &text[..end];
        for found in build(beginning, FULL).diagnostics {
            let marked = &beginning[found.span.start as usize..found.span.end as usize];
            let is_false = defines(beginning, marked) || beginning.ends_with(marked);
            let has_syntax_error = build(beginning, FULL)
                .diagnostics
                .iter()
                .any(|found| ["E01", "E02"].iter().any(|kind| found.code.text().starts_with(kind)));
            assert!(
                !(UNKNOWN.contains(&found.code.text()) && has_syntax_error && is_false),
                "{} up to {end}: {} at `{marked}`",
                path.display(),
                found.code.text()
            );
        }
    }
}

#[test]
fn no_known_name_is_called_unknown() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples");
    let examples = examples(&folder);
    assert!(examples.len() > 30, "{}", examples.len());
    for (number, path) in examples.iter().enumerate() {
        check(path, 17 + number % 5);
    }
}

/// Every beginning: `cargo test --release -p bittybuzz-compiler --test back beginnings -- --ignored`.
#[test]
#[ignore = "takes a minute"]
fn no_known_name_is_called_unknown_in_any_beginning() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples");
    examples(&folder).iter().for_each(|path| check(path, 1));
}
