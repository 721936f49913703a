//! A copy of the repository in which guides are carried out.
//!
//! It stays where it is between tests, so that only what changes is built again.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;

use bittybuzz_tests::bbz;

use super::{Action, Cause, Failure, Guide, console};

/// The copy. Only one test has it at a time.
pub struct Copy {
    root: PathBuf,
    /// Folders of programs that users have in their search path after what a guide asks for before it begins.
    programs: Vec<PathBuf>,
    _lock: File,
}

impl Copy {
    /// Copies the repository as it is now, uncommitted changes included, to a place below a folder that cargo keeps for tests.
    pub fn new(folder: &Path, programs: &[&Path]) -> io::Result<Self> {
        fs::create_dir_all(folder)?;
        let lock = File::create(folder.join("repository.lock"))?;
        lock.lock()?;
        let programs = programs.iter().filter_map(|program| program.parent());
        let copy = Copy {
            root: folder.join("repository"),
            programs: programs.map(Path::to_owned).collect(),
            _lock: lock,
        };
        let files = files()?;
        copy.remove_all_but(&files, Path::new(""))?;
        for file in &files {
            copy.put(file, &fs::read(bbz::root().join(file))?)?;
        }
        Ok(copy)
    }

    /// Cargo builds anew what is newer: a file that is right already is not touched.
    fn put(&self, file: &Path, bytes: &[u8]) -> io::Result<()> {
        let path = self.root.join(file);
        if fs::read(&path).is_ok_and(|there| there == bytes) {
            return Ok(());
        }
        path.parent().map_or(Ok(()), fs::create_dir_all)?;
        fs::write(path, bytes)
    }

    fn remove_all_but(&self, files: &[PathBuf], folder: &Path) -> io::Result<()> {
        let Ok(entries) = fs::read_dir(self.root.join(folder)) else { return Ok(()) };
        for entry in entries {
            let entry = entry?;
            let path = folder.join(entry.file_name());
            match entry.file_type()?.is_dir() {
                true if entry.file_name() == "target" => {}
                true => {
                    self.remove_all_but(files, &path)?;
                    // Goes if it is empty.
                    let _ = fs::remove_dir(entry.path());
                }
                false if files.binary_search(&path).is_ok() => {}
                false => fs::remove_file(entry.path())?,
            }
        }
        Ok(())
    }

    /// Does what a guide says.
    pub fn carry_out(&self, guide: &Guide) -> Result<(), Failure> {
        for step in &guide.steps {
            let fail = |line, cause| Failure::new(&guide.path, line, cause);
            match &step.action {
                Action::Edit(file, edit) => {
                    let unusable = |error| Cause::File { file: file.clone(), error };
                    let before = match fs::read_to_string(self.root.join(file)) {
                        Ok(text) => Some(text),
                        Err(error) if error.kind() == io::ErrorKind::NotFound => None,
                        Err(error) => return Err(fail(step.line, unusable(error))),
                    };
                    let after = edit.apply(before.as_deref()).map_err(|misfit| {
                        fail(step.line, Cause::Misfit { file: file.clone(), misfit })
                    })?;
                    self.put(Path::new(file), after.as_bytes())
                        .map_err(|error| fail(step.line, unusable(error)))?;
                }
                Action::Run(block) => {
                    let promises = console::promises(block)
                        .ok_or_else(|| fail(step.line, Cause::NoCommand))?;
                    console::run(&mut self.shell(), &promises)
                        .map_err(|error| fail(step.line, Cause::Shell(error)))?
                        .map_err(|(number, otherwise)| {
                            let line = step.line + promises[number].line;
                            fail(line, Cause::Otherwise(otherwise))
                        })?;
                }
            }
        }
        Ok(())
    }

    /// A shell with the tools in the search path.
    fn shell(&self) -> Command {
        let mut path = vec![self.root.join("target/debug")];
        path.extend(self.programs.iter().cloned());
        path.extend(std::env::split_paths(&std::env::var_os("PATH").unwrap_or_default()));
        let path = std::env::join_paths(path).expect("parts of a search path");
        let mut shell = Command::new("sh");
        // What the cargo of this test has set does not hold in the copy, nor what a user may have set.
        for name in [
            "RUSTUP_TOOLCHAIN",
            "RUSTFLAGS",
            "CARGO",
            "CARGO_ENCODED_RUSTFLAGS",
            "CARGO_TARGET_DIR",
            "BBZ_SCRIPT",
            "BUZZ_INCLUDE_PATH",
        ] {
            shell.env_remove(name);
        }
        // Not the folder of this test: cargo takes a crate of the copy for the one in the same place of the repository, and
        // would run what a guide has changed in other tests. Boards and tools share what they have in common.
        shell.env("CARGO_BUILD_BUILD_DIR", self.root.join("target/build"));
        // Compilers take most of the time here, and what they make runs for seconds.
        shell.env("CARGO_PROFILE_DEV_OPT_LEVEL", "0").env("CARGO_PROFILE_DEV_DEBUG", "none");
        shell.env("PATH", path).current_dir(&self.root);
        shell
    }
}

/// The files of the repository: those that git knows, or would add. Sorted.
fn files() -> io::Result<Vec<PathBuf>> {
    let mut git = Command::new("git");
    git.args(["ls-files", "-z", "--cached", "--others", "--exclude-standard"]);
    let output = git.current_dir(bbz::root()).output()?;
    if !output.status.success() {
        return Err(io::Error::other(String::from_utf8_lossy(&output.stderr).into_owned()));
    }
    let names = String::from_utf8_lossy(&output.stdout);
    let names = names.split_terminator('\0').map(PathBuf::from);
    // One that was removed is known until that is committed.
    let mut files: Vec<PathBuf> = names.filter(|name| bbz::root().join(name).is_file()).collect();
    files.sort();
    files.dedup();
    Ok(files)
}
