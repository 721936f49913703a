//! A copy of the repository, in which tests follow the guides and introduce mistakes.
//!
//! The copy is kept between uses, so that only changes are built again.

use crate::seed::seed;
use crate::shell::{Invocation, root};
use anyhow::Result;
use fs_err::{self as fs, File};
use std::collections::HashSet;
use std::path::{Path, PathBuf};

/// Settings of cargo for the copy, stored in a folder above the copy. They add to the repository's
/// own settings. They are a file, because environment variables can change a setting for all
/// packages, but not for one.
///
/// With the repository's optimization level, the simulator takes a minute to build, and most guides
/// build it.
const SETTINGS: &str = "[profile.dev.package.bittybuzz-arena]\nopt-level = 0\n";

/// The build folder of all workspaces of the repository, as set in .cargo/config.toml.
pub const BUILT: &str = "target";

/// A copy that is locked, so that one test or chore uses it at a time.
pub struct Copy {
    root: PathBuf,
    _lock: File,
}

impl Copy {
    /// Copies the repository in its present state, uncommitted changes included, to a place below a
    /// folder that git ignores. A new copy also gets the crates of others that are compiled already.
    pub fn new(folder: &Path) -> Result<Copy> {
        let copy = Copy::of_sources(folder)?;
        let built = copy.build_folder();
        if !built.exists() {
            seed(&root().join(BUILT), &built, &own_packages()?)?;
        }
        Ok(copy)
    }

    fn of_sources(folder: &Path) -> Result<Copy> {
        fs::create_dir_all(folder)?;
        let lock = File::create(folder.join("repository.lock"))?;
        lock.file().lock()?;
        let copy = Copy { root: folder.join("repository"), _lock: lock };
        copy.put("../.cargo/config.toml", SETTINGS.as_bytes())?;
        let files = files()?;
        copy.remove_all_but(&files, Path::new(""))?;
        for file in &files {
            copy.put(file, &fs::read(root().join(file))?)?;
        }
        Ok(copy)
    }

    /// Returns the build folder of the copy.
    fn build_folder(&self) -> PathBuf {
        self.root.join(BUILT).join("build")
    }

    /// Returns the root of the copy.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// Writes a file. A file that already has these bytes is not touched, because cargo rebuilds
    /// newer files.
    pub fn put(&self, file: &str, bytes: &[u8]) -> Result<()> {
        let path = self.root.join(file);
        if !fs::read(&path).is_ok_and(|there| there == bytes) {
            path.parent().map_or(Ok(()), fs::create_dir_all)?;
            fs::write(path, bytes)?;
        }
        Ok(())
    }

    /// Returns the environment variables with which cargo builds in the copy.
    pub fn variables(&self) -> [(&'static str, String); 4] {
        [
            // A build folder of its own, not that of the repository: cargo would take a crate of
            // the copy for the one at the same place in the repository, and run the changed crate
            // in tests of the repository. Boards and tools in the copy share their compiled
            // dependencies.
            ("CARGO_BUILD_BUILD_DIR", self.build_folder().display().to_string()),
            // The compilers take most of the time here, because the programs run only for seconds.
            ("CARGO_PROFILE_DEV_OPT_LEVEL", "0".to_owned()),
            ("CARGO_PROFILE_DEV_DEBUG", "none".to_owned()),
            // Most builds follow a change, also in CI, where every other build happens only once.
            // CARGO_INCREMENTAL would also apply to the release profile, in which the AVR's
            // compiler then refuses `sts` in assembly.
            ("CARGO_PROFILE_DEV_INCREMENTAL", "true".to_owned()),
        ]
    }

    fn remove_all_but(&self, files: &[String], folder: &Path) -> Result<()> {
        let Ok(entries) = fs::read_dir(self.root.join(folder)) else { return Ok(()) };
        for entry in entries {
            let entry = entry?;
            let path = folder.join(entry.file_name());
            let is_kept = |file: &String| Path::new(file) == path;
            match entry.file_type()?.is_dir() {
                true if entry.file_name() == "target" => {}
                true => {
                    self.remove_all_but(files, &path)?;
                    // This removes the folder only if it is empty.
                    let _ = fs::remove_dir(entry.path());
                }
                false if files.iter().any(is_kept) => {}
                false => fs::remove_file(entry.path())?,
            }
        }
        Ok(())
    }
}

/// Returns the names of the packages of all workspaces.
fn own_packages() -> Result<HashSet<String>> {
    let mut names = HashSet::new();
    for file in files()?.iter().filter(|file| file.ends_with("Cargo.toml")) {
        let text = fs::read_to_string(root().join(file))?;
        let name = text.lines().find_map(|line| line.strip_prefix("name = \""));
        names.extend(name.and_then(|name| name.strip_suffix('"')).map(str::to_owned));
    }
    Ok(names)
}

/// Returns the files of the repository, as sorted paths from the root: those that git tracks or
/// would add.
pub fn files() -> Result<Vec<String>> {
    // Only names are read, so the owner of the folder, which differs on a CI machine, does not
    // matter.
    let whoever = ["-c", "safe.directory=*", "ls-files"];
    let arguments = [&whoever[..], &["-z", "--cached", "--others", "--exclude-standard"]];
    let output = Invocation::new("git", &arguments.concat()).unannounced().output(0)?;
    let names = String::from_utf8_lossy(&output.stdout).into_owned();
    // Git lists a deleted file until the deletion is committed.
    let there = |name: &&str| root().join(name).is_file();
    let mut files: Vec<String> =
        names.split_terminator('\0').filter(there).map(str::to_owned).collect();
    files.sort();
    files.dedup();
    Ok(files)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::SystemTime;

    #[test]
    fn a_copy_is_mended_and_otherwise_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let copy = Copy::of_sources(folder.path()).unwrap();
        let [kept, changed, added] = ["Cargo.toml", "xtask/Cargo.toml", "xtask/new/file"];
        let long_ago = SystemTime::UNIX_EPOCH;
        let file = fs::File::options().write(true).open(copy.root().join(kept)).unwrap();
        file.file().set_modified(long_ago).unwrap();
        copy.put(changed, b"changed").unwrap();
        copy.put(added, b"new").unwrap();
        copy.put("target/kept", b"built").unwrap();
        drop(copy);
        let copy = Copy::of_sources(folder.path()).unwrap();
        let original = fs::read(root().join(changed)).unwrap();
        assert_eq!(fs::read(copy.root().join(changed)).unwrap(), original);
        let modified = fs::metadata(copy.root().join(kept)).unwrap().modified().unwrap();
        assert_eq!(modified, long_ago);
        assert!(!copy.root().join("xtask/new").exists());
        assert!(copy.root().join("target/kept").exists());
    }
}
