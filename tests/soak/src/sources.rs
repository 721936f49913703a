//! The sources as they are in the working folder: their fingerprint, and a copy that may be changed.

use anyhow::Result;
use bittybuzz_builds::shell::{Line, root};
use fs_err as fs;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::Path;

/// Files of the repository, from the root.
pub struct Sources {
    files: Vec<String>,
}

impl Sources {
    /// Everything that git keeps or would.
    pub fn list() -> Result<Sources> {
        // Only names are read: it does not matter whose folder this is, as on a CI machine.
        let whoever = ["-c", "safe.directory=*", "ls-files"];
        let arguments = [&whoever[..], &["-z", "--cached", "--others", "--exclude-standard"]];
        let output = Line::new("git", &arguments.concat()).unannounced().output(0)?;
        let names = String::from_utf8_lossy(&output.stdout).into_owned();
        // A file that was deleted is still listed until that is committed.
        let there = |name: &&str| root().join(name).is_file();
        let mut files: Vec<String> =
            names.split_terminator('\0').filter(there).map(str::to_owned).collect();
        files.sort();
        files.dedup();
        Ok(Sources { files })
    }

    /// Those whose path starts in one of these ways; `*` is the name of any folder.
    pub fn under(&self, starts: &[&str]) -> Sources {
        let wanted = |name: &&String| starts.iter().any(|start| is_under(name, start));
        Sources { files: self.files.iter().filter(wanted).cloned().collect() }
    }

    /// A number that changes with the code of programs, and with the lines at which it stands. Documents do not count,
    /// nor does the text of comments.
    pub fn fingerprint(&self) -> Result<u64> {
        let mut hasher = DefaultHasher::new();
        for name in self.files.iter().filter(|name| !name.ends_with(".md")) {
            let bytes = fs::read(root().join(name))?;
            match str::from_utf8(&bytes) {
                Ok(text) if name.ends_with(".rs") => {
                    (name, without_comments(text)).hash(&mut hasher)
                }
                _ => (name, bytes).hash(&mut hasher),
            }
        }
        Ok(hasher.finish())
    }

    /// Brings a copy up to date. Files that are the same stay untouched, for cargo to see that they are.
    pub fn copy_to(&self, folder: &Path) -> Result<()> {
        for name in &self.files {
            let bytes = fs::read(root().join(name))?;
            let path = folder.join(name);
            if !fs::read(&path).is_ok_and(|there| there == bytes) {
                write(&path, &bytes)?;
            }
        }
        Ok(())
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
    use std::time::SystemTime;

    #[test]
    fn the_text_of_comments_does_not_count() {
        let lines = without_comments("/// One.\nfn f() {\n    // Two.\n    g(); // Three.\n}\n");
        assert_eq!(lines, ["", "fn f() {", "", "    g(); // Three.", "}"]);
        assert_ne!(lines, without_comments("fn f() {\n    g(); // Three.\n}\n"));
    }

    #[test]
    fn a_star_is_the_name_of_one_folder() {
        assert!(is_under("robots/spec/src/lib.rs", "robots/spec/"));
        assert!(is_under("robots/crazyflie/robot.toml", "robots/*/robot.toml"));
        assert!(!is_under("robots/crazyflie/model/robot.toml", "robots/*/robot.toml"));
        assert!(!is_under("robots/robot.toml", "robots/*/robot.toml"));
        assert!(!is_under("firmware/crazyflie/robot.toml", "robots/*/robot.toml"));
    }

    #[test]
    fn a_copy_is_mended_and_otherwise_left_alone() {
        let folder = std::env::temp_dir().join(format!("xtask-sources-{}", std::process::id()));
        let sources =
            Sources { files: vec!["Cargo.toml".to_owned(), "xtask/Cargo.toml".to_owned()] };
        sources.copy_to(&folder).unwrap();
        let long_ago = SystemTime::UNIX_EPOCH;
        let kept = fs::File::options().write(true).open(folder.join("Cargo.toml")).unwrap();
        kept.set_modified(long_ago).unwrap();
        write(&folder.join("xtask/Cargo.toml"), b"changed").unwrap();
        sources.copy_to(&folder).unwrap();
        let original = fs::read(root().join("xtask/Cargo.toml")).unwrap();
        assert_eq!(fs::read(folder.join("xtask/Cargo.toml")).unwrap(), original);
        let modified = fs::metadata(folder.join("Cargo.toml")).unwrap().modified().unwrap();
        assert_eq!(modified, long_ago);
        fs::remove_dir_all(folder).unwrap();
    }
}
