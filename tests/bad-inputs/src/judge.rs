//! The rules that every call keeps.

use std::collections::BTreeMap;
use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};

use crate::controls;

/// The statuses that docs/cli.md describes, without that of a defect.
const STATUSES: [i32; 4] = [0, 1, 2, 3];

/// The outcome of a call.
#[derive(Debug, Default)]
pub struct Outcome {
    /// The exit status; `None` if a signal ended the process.
    pub status: Option<i32>,
    pub stdout: Vec<u8>,
    pub stderr: Vec<u8>,
    /// True if the process did not end in time.
    pub hangs: bool,
}

/// The content of each file of a folder, or its kind.
pub type Snapshot = BTreeMap<PathBuf, Vec<u8>>;

/// The place where a call reports why it failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Report {
    /// Standard error; a run-time error and failed expectations may be in the result instead.
    Messages,
    /// The object of `--json`.
    Object,
    /// A stream that the test does not see.
    Elsewhere,
}

/// Returns the rules that a call broke.
pub fn broken(
    outcome: &Outcome,
    report: Report,
    [before, after]: [&Snapshot; 2],
    outputs: &[OsString],
) -> Vec<String> {
    let mut broken = Vec::new();
    let stderr = String::from_utf8_lossy(&outcome.stderr);
    match outcome.status {
        _ if outcome.hangs => broken.push("does not end".to_owned()),
        None => broken.push("a signal ended it".to_owned()),
        Some(status) if !STATUSES.contains(&status) => broken.push(format!("status {status}")),
        Some(status) => {
            let has_result = !outcome.stdout.is_empty();
            let is_explained = match report {
                Report::Messages => status == 1 && has_result,
                Report::Object => has_result,
                Report::Elsewhere => true,
            };
            if status != 0 && stderr.trim().is_empty() && !is_explained {
                broken.push(format!("status {status} without a sentence"));
            }
        }
    }
    let stdout = String::from_utf8_lossy(&outcome.stdout);
    if [&stderr, &stdout].iter().any(|text| has_defect(text)) {
        broken.push("a defect".to_owned());
    }
    for (name, bytes) in [("standard output", &outcome.stdout), ("standard error", &outcome.stderr)]
    {
        match std::str::from_utf8(bytes) {
            Err(_) => broken.push(format!("{name} is not UTF-8")),
            Ok(text) => {
                if let Some(c) = controls::found_in(text) {
                    broken.push(format!("{name} has U+{:04X}", u32::from(c)));
                }
            }
        }
    }
    let names = before.keys().chain(after.keys().filter(|name| !before.contains_key(*name)));
    for name in names.filter(|name| before.get(*name) != after.get(*name)) {
        if !is_output(name, outputs) {
            let change = match (before.contains_key(name), after.contains_key(name)) {
                (true, true) => "changed",
                (true, false) => "removed",
                _ => "made",
            };
            broken.push(format!("{change} {}", name.display()));
        }
    }
    broken
}

/// Returns true if a text reports a defect: `defect of bbz`, and the version. The help names defects,
/// too.
fn has_defect(text: &str) -> bool {
    let versions = text.split("defect of bbz ").skip(1);
    let is_version = |rest: &str| rest.starts_with(|c: char| c.is_ascii_digit());
    text.contains("panicked at") || versions.map(str::trim_start).any(is_version)
}

/// Returns true for an output, a file in a folder that is one, and the journal of a table.
fn is_output(name: &Path, outputs: &[OsString]) -> bool {
    outputs.iter().any(|output| {
        let mut journal = output.clone();
        journal.push(OsStr::new(".parts"));
        name.starts_with(output) || name.starts_with(journal)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rules(outcome: &Outcome) -> Vec<String> {
        broken(outcome, Report::Messages, [&Snapshot::new(), &Snapshot::new()], &[])
    }

    #[test]
    fn broken_rules_are_found() {
        let fine = Outcome { status: Some(3), stderr: b"error: no".to_vec(), ..Outcome::default() };
        assert_eq!(rules(&fine), [""; 0]);
        let ended = |status| Outcome { status, stderr: b"error".to_vec(), ..Outcome::default() };
        assert_eq!(rules(&ended(None)), ["a signal ended it"]);
        assert_eq!(rules(&ended(Some(101))), ["status 101"]);
        assert_eq!(rules(&Outcome { hangs: true, ..ended(None) }), ["does not end"]);
        let silent = Outcome { status: Some(2), ..Outcome::default() };
        assert_eq!(rules(&silent), ["status 2 without a sentence"]);
        let printing = |stdout: &[u8]| Outcome { stdout: stdout.to_vec(), ..ended(Some(0)) };
        assert_eq!(rules(&printing("\u{9b}".as_bytes())), ["standard output has U+009B"]);
        assert_eq!(rules(&printing(b"\x9b")), ["standard output is not UTF-8"]);
        assert_eq!(rules(&printing(b"101 defect of bbz.\n")), [""; 0]);
        let defect = Outcome {
            stderr: b"error: defect of bbz 1 at a.rs:1".to_vec(),
            ..Outcome { status: Some(1), ..Outcome::default() }
        };
        assert_eq!(rules(&defect), ["a defect"]);
    }

    #[test]
    fn only_outputs_may_change() {
        let snapshot = |files: &[(&str, &str)]| -> Snapshot {
            files.iter().map(|(name, text)| (PathBuf::from(name), text.as_bytes().into())).collect()
        };
        let before = snapshot(&[("in", "1"), ("kept", "1"), ("out", "1")]);
        let after = snapshot(&[("in", "2"), ("new", "1"), ("out", "2"), ("out.parts/lock", "")]);
        let fine = Outcome { status: Some(0), ..Outcome::default() };
        let found = broken(&fine, Report::Messages, [&before, &after], &["out".into()]);
        assert_eq!(found, ["changed in", "removed kept", "made new"]);
    }
}
