//! The last successful run of each guide, and the files on which its result depends.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use anyhow::{Context, Result};
use bittybuzz_builds::copy::files;
use bittybuzz_builds::shell::root;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::guide::Guide;

/// The file with the runs, from the root of the repository.
pub const FILE: &str = "tests/guides/runs.toml";

const HEAD: &str = "\
# The last successful run of each guide, and the hash of the files that the guide names, reads or edits.
# `cargo xtask soak guides` writes this file.
";

/// A successful run of a guide.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Run {
    /// The day of the run, as `YYYY-MM-DD`.
    pub date: String,
    /// The hash of the files at that time, in hexadecimal digits.
    pub files: String,
}

/// The runs by the path of the guide.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Runs(BTreeMap<String, Run>);

impl Runs {
    /// Reads the file of the repository.
    pub fn load() -> Result<Runs> {
        let text = fs_err::read_to_string(root().join(FILE))?;
        Runs::parse(&text)
    }

    fn parse(text: &str) -> Result<Runs> {
        toml::from_str(text).with_context(|| format!("{FILE} is not as `soak guides` writes it"))
    }

    /// Returns the paths of the guides that have run.
    pub fn pages(&self) -> impl Iterator<Item = &str> {
        self.0.keys().map(String::as_str)
    }

    /// Returns the last run of a guide, if its files had this hash then.
    pub fn with_hash(&self, page: &str, files: &str) -> Option<&Run> {
        self.0.get(page).filter(|run| run.files == files)
    }

    /// Returns the pages with a file that has changed since their recorded run.
    pub fn due(&self) -> Result<Vec<&str>> {
        self.due_if(|page| {
            let text = fs_err::read_to_string(root().join(page))?;
            hash(&Guide::read(page, &text)?, &text)
        })
    }

    /// Returns the pages for which `hash` is not the recorded one.
    fn due_if(&self, hash: impl Fn(&str) -> Result<String>) -> Result<Vec<&str>> {
        let mut due = Vec::new();
        for page in self.pages() {
            if self.with_hash(page, &hash(page)?).is_none() {
                due.push(page);
            }
        }
        Ok(due)
    }

    /// Records a run, and writes the file of the repository.
    pub fn record(&mut self, page: &str, run: Run) -> Result<()> {
        self.0.insert(page.to_owned(), run);
        fs_err::write(root().join(FILE), self.text()?)?;
        Ok(())
    }

    fn text(&self) -> Result<String> {
        Ok(format!("{HEAD}\n{}", toml::to_string(self)?))
    }
}

/// Returns the hash of the files that a guide names, reads or edits, the guide included.
pub fn hash(guide: &Guide, text: &str) -> Result<String> {
    let tracked = files()?;
    let mut hash = Sha256::new();
    for file in dependencies(guide, text, &tracked) {
        let bytes = fs_err::read(root().join(file))?;
        // The length keeps the end of one file apart from the begin of the next.
        hash.update(format!("{file}\n{}\n", bytes.len()));
        hash.update(bytes);
    }
    Ok(hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect())
}

/// Returns the files of the repository on which a guide depends: the guide, the files that it edits,
/// the files that its text or links name, and all files of a folder that its commands name.
fn dependencies<'a>(guide: &Guide, text: &str, tracked: &'a [String]) -> BTreeSet<&'a str> {
    let mut named: BTreeSet<String> = guide.edited().map(str::to_owned).collect();
    named.insert(guide.path().to_owned());
    let folder = Path::new(guide.path()).parent().unwrap_or(Path::new(""));
    for word in words(text) {
        // A link starts at the folder of the guide, a path in text or in a command at the root.
        named.extend(normalized(&folder.join(word)));
        named.extend(normalized(Path::new(word)));
    }
    let folders: BTreeSet<String> = guide
        .commands()
        .flat_map(words)
        .filter(|word| word.contains('/'))
        .filter_map(|word| normalized(Path::new(word)))
        .collect();
    let is_needed = |file: &&str| {
        named.contains(*file)
            || Path::new(file)
                .ancestors()
                .skip(1)
                .any(|above| above.to_str().is_some_and(|above| folders.contains(above)))
    };
    tracked.iter().map(String::as_str).filter(is_needed).collect()
}

/// Returns the parts of a text that can be paths.
fn words(text: &str) -> impl Iterator<Item = &str> {
    let is_of_path = |letter: char| letter.is_alphanumeric() || "/._-".contains(letter);
    text.split(move |letter| !is_of_path(letter))
        .map(|word| word.trim_end_matches(['.', '/']))
        .filter(|word| !word.is_empty())
}

/// Returns a path without `.` and `..`; `None` if it leaves the root or is absolute.
fn normalized(path: &Path) -> Option<String> {
    use std::path::Component;
    let mut parts: Vec<&str> = Vec::new();
    for component in path.components() {
        match component {
            Component::Normal(part) => parts.push(part.to_str()?),
            Component::CurDir => {}
            Component::ParentDir => {
                parts.pop()?;
            }
            Component::RootDir | Component::Prefix(_) => return None,
        }
    }
    Some(parts.join("/"))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a failure here fails the test")]

    use super::*;

    const TEXT: &str = "See [the map](../MAP.md) and `spec/a.rs`.\n\nNew file `new.rs`:\n```rust\nx\n```\n\n\
                        In `old.rs`, after `x`:\n```rust\ny\n```\n\n```console\n$ cd board/one && make\n$ run here.bzz\n```\n";

    #[test]
    fn a_guide_depends_on_the_files_that_it_names_reads_or_edits() {
        let tracked: Vec<String> = [
            "MAP.md",
            "board/one/deep/x.rs",
            "board/two.rs",
            "docs/MAP.md",
            "docs/guide.md",
            "here.bzz",
            "old.rs",
            "other.rs",
            "spec/a.rs",
            "spec/b.rs",
        ]
        .map(str::to_owned)
        .to_vec();
        let guide = Guide::read("docs/guide.md", TEXT).unwrap();
        let found: Vec<&str> = dependencies(&guide, TEXT, &tracked).into_iter().collect();
        let expected =
            ["MAP.md", "board/one/deep/x.rs", "docs/guide.md", "here.bzz", "old.rs", "spec/a.rs"];
        assert_eq!(found, expected);
    }

    #[test]
    fn runs_survive_a_round_trip() {
        let mut runs = Runs::default();
        let run = Run { date: "2026-11-25".to_owned(), files: "00ff".to_owned() };
        runs.0.insert("docs/guide.md".to_owned(), run.clone());
        let read = Runs::parse(&runs.text().unwrap()).unwrap();
        assert_eq!(read, runs);
        assert_eq!(read.with_hash("docs/guide.md", "00ff"), Some(&run));
        assert_eq!(read.with_hash("docs/guide.md", "00fe"), None);
        assert_eq!(read.with_hash("docs/other.md", "00ff"), None);
    }

    #[test]
    fn a_guide_is_due_if_its_files_have_changed() {
        let mut runs = Runs::default();
        for (page, files) in [("docs/a.md", "0a"), ("docs/b.md", "0b")] {
            let run = Run { date: "2026-11-25".to_owned(), files: files.to_owned() };
            runs.0.insert(page.to_owned(), run);
        }
        let with = |a: &str, b: &str| {
            let hash = |page: &str| Ok(if page == "docs/a.md" { a } else { b }.to_owned());
            runs.due_if(hash).unwrap()
        };
        assert!(with("0a", "0b").is_empty());
        assert_eq!(with("0a", "0c"), ["docs/b.md"]);
        assert_eq!(with("0b", "0a"), ["docs/a.md", "docs/b.md"]);
        assert!(runs.due_if(|page| anyhow::bail!("no {page}")).is_err());
    }

    #[test]
    fn a_path_stays_in_the_repository() {
        assert_eq!(normalized(Path::new("docs/../MAP.md")).as_deref(), Some("MAP.md"));
        assert_eq!(normalized(Path::new("../MAP.md")), None);
        assert_eq!(normalized(Path::new("/etc/passwd")), None);
    }
}
