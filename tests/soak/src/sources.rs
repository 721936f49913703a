//! The sources as they are in the working folder, and their fingerprint.

use anyhow::Result;
use bittybuzz_builds::copy::files;
use bittybuzz_builds::shell::root;
use fs_err as fs;
use sha2::{Digest, Sha256};
use std::path::Path;

/// Files that hold dates of runs, from the root. The runs themselves change them.
const RUNS: [&str; 6] = [
    crate::evidence::FILE,
    crate::executions::FILE,
    crate::flights::FILE,
    crate::image_flights::FILE,
    crate::pages::FILE,
    "tests/guides/runs.toml",
];

/// Files of the repository, from the root.
pub struct Sources {
    files: Vec<String>,
}

impl Sources {
    /// Everything that git keeps or would.
    pub fn list() -> Result<Sources> {
        Ok(Sources { files: files()? })
    }

    /// Those whose path starts in one of these ways; `*` is the name of any folder.
    pub fn under(&self, starts: &[&str]) -> Sources {
        let wanted = |name: &&String| starts.iter().any(|start| is_under(name, start));
        Sources { files: self.files.iter().filter(wanted).cloned().collect() }
    }

    /// A number that changes with the code of programs, and with the lines at which it stands. Documents and files with
    /// dates of runs do not count, nor do the text of comments and the budgets of images.
    pub fn fingerprint(&self) -> Result<u64> {
        let is_code = |name: &&String| !name.ends_with(".md");
        Sources { files: self.files.iter().filter(is_code).cloned().collect() }
            .fingerprint_with_documents()
    }

    /// The same, of documents, too.
    pub fn fingerprint_with_documents(&self) -> Result<u64> {
        let mut hash = Sha256::new();
        let is_source = |name: &&String| !RUNS.contains(&name.as_str());
        for name in self.files.iter().filter(is_source) {
            let bytes = fs::read(root().join(name))?;
            let bytes = match String::from_utf8(bytes) {
                Ok(text) if name.ends_with(".rs") => {
                    without_comments(&text).join("\n").into_bytes()
                }
                Ok(text) if name.ends_with("/robot.toml") => {
                    without_budgets(&text).join("\n").into_bytes()
                }
                Ok(text) => text.into_bytes(),
                Err(error) => error.into_bytes(),
            };
            // The length keeps the end of one file apart from the begin of the next.
            hash.update(format!("{name}\n{}\n", bytes.len()));
            hash.update(bytes);
        }
        let start = hash.finalize().iter().take(8).fold(0, |sum, byte| sum << 8 | u64::from(*byte));
        Ok(start)
    }
}

fn is_under(name: &str, start: &str) -> bool {
    match start.split_once("*/") {
        None => name.starts_with(start),
        Some((before, after)) => name
            .strip_prefix(before)
            .and_then(|rest| rest.split_once('/'))
            .is_some_and(|(_, rest)| rest.starts_with(after)),
    }
}

/// The lines of a Rust file; those that are a comment are empty.
fn without_comments(text: &str) -> Vec<&str> {
    text.lines().map(|line| if line.trim_start().starts_with("//") { "" } else { line }).collect()
}

/// The lines of a robot file; those of a budget are empty. Only the check of an image's size reads them.
fn without_budgets(text: &str) -> Vec<&str> {
    let is_budget = |line: &&str| line.starts_with("flash_bytes") || line.starts_with("ram_bytes");
    text.lines().map(|line| if is_budget(&line) { "" } else { line }).collect()
}

/// Writes a file, and makes the folders that it needs.
pub fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder)?;
    }
    Ok(fs::write(path, bytes)?)
}

/// Empties the table of a batch, and forgets the runs of one that was stopped: they may be of older sources.
pub fn clear_table(path: &Path) -> Result<()> {
    write(path, b"")?;
    match fs::remove_dir_all(path.with_added_extension("parts")) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => Err(error.into()),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_text_of_comments_does_not_count() {
        let lines = without_comments("/// One.\nfn f() {\n    // Two.\n    g(); // Three.\n}\n");
        assert_eq!(lines, ["", "fn f() {", "", "    g(); // Three.", "}"]);
        assert_ne!(lines, without_comments("fn f() {\n    g(); // Three.\n}\n"));
    }

    #[test]
    fn budgets_do_not_count() {
        let file = "[vm]\nslots = 5\n\n[budget]\nflash_bytes = 9\nram_bytes = 8\n";
        assert_eq!(without_budgets(file), ["[vm]", "slots = 5", "", "[budget]", "", ""]);
    }

    #[test]
    fn a_star_is_the_name_of_one_folder() {
        assert!(is_under("spec/robot/src/lib.rs", "spec/robot/"));
        assert!(is_under("robots/crazyflie/robot.toml", "robots/*/robot.toml"));
        assert!(!is_under("robots/crazyflie/model/robot.toml", "robots/*/robot.toml"));
        assert!(!is_under("robots/robot.toml", "robots/*/robot.toml"));
        assert!(!is_under("firmware/crazyflie/robot.toml", "robots/*/robot.toml"));
    }
}
