//! The executions of each fuzz target without a panic, in a file that is committed: they take hours, and another computer
//! goes on from there.

use anyhow::{Context, Result};
use bittybuzz_builds::shell::{Invocation, root};
use fs_err as fs;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The file, from the root.
pub const FILE: &str = "tests/soak/fuzz.toml";

const HEAD: &str = "\
# Executions of each fuzz target without a panic, and the fingerprint of the files that the target exercises.
# `cargo xtask soak fuzz` writes this file. Executions count until one of these files changes.
";

/// The executions of a target.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Count {
    executions: u64,
    /// The day of the last of them, as `YYYY-MM-DD`.
    date: String,
    /// The fingerprint of the files, in hexadecimal digits.
    files: String,
}

/// The executions of all targets.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Executions(BTreeMap<String, Count>);

impl Executions {
    /// Reads the file of the repository.
    pub fn load() -> Result<Executions> {
        Executions::parse(&fs::read_to_string(root().join(FILE))?)
    }

    fn parse(text: &str) -> Result<Executions> {
        toml::from_str(text).with_context(|| format!("{FILE} is not as `soak fuzz` writes it"))
    }

    /// Returns the executions of a target about files with this fingerprint.
    pub fn of(&self, target: &str, fingerprint: u64) -> u64 {
        let count = self.0.get(target).filter(|count| count.files == digits(fingerprint));
        count.map_or(0, |count| count.executions)
    }

    /// Adds executions of a target, and writes the file of the repository.
    pub fn add(&mut self, target: &str, fingerprint: u64, executions: u64) -> Result<()> {
        let output = Invocation::new("date", &["+%F"]).unannounced().output(0)?;
        self.count(target, fingerprint, executions, String::from_utf8(output.stdout)?.trim());
        let text = toml::to_string(self)?;
        Ok(fs::write(root().join(FILE), format!("{HEAD}\n{text}"))?)
    }

    fn count(&mut self, target: &str, fingerprint: u64, executions: u64, date: &str) {
        let executions = self.of(target, fingerprint) + executions;
        let count = Count { executions, date: date.to_owned(), files: digits(fingerprint) };
        self.0.insert(target.to_owned(), count);
    }
}

fn digits(fingerprint: u64) -> String {
    format!("{fingerprint:016x}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn executions_are_added_while_the_files_stay_the_same() {
        let mut executions = Executions::default();
        executions.count("bo", 7, 100, "2026-11-26");
        executions.count("bo", 7, 23, "2026-11-27");
        assert_eq!(
            (executions.of("bo", 7), executions.of("bo", 8), executions.of("ir", 7)),
            (123, 0, 0)
        );
        let text = toml::to_string(&executions).unwrap();
        assert_eq!(Executions::parse(&text).unwrap(), executions);
        executions.count("bo", 8, 5, "2026-11-27");
        assert_eq!((executions.of("bo", 7), executions.of("bo", 8)), (0, 5));
    }

    #[test]
    fn the_file_is_about_existing_targets() {
        let known = crate::fuzz::items();
        for target in Executions::load().unwrap().0.keys() {
            assert!(known.contains(target), "{FILE}: {target}");
        }
    }
}
