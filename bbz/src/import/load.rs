//! Loads a scenario as `bbz sim` does, except for scripts that do not exist yet.

use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use bittybuzz_arena::scenario::{Scenario, ScenarioError};
use bittybuzz_compiler::include::{DiskFiles, FileKind, Files};

/// Returns the mistakes of a scenario.
pub fn errors(text: &str, path: &Path) -> Vec<ScenarioError> {
    let models = bittybuzz_robot_models::all();
    let scenario = Scenario::parse_in(&WithScripts, text, path, &[], &models);
    scenario.err().unwrap_or_default()
}

/// The files on disk, and any script.
struct WithScripts;

impl Files for WithScripts {
    fn read(&self, path: &Path, most: usize) -> io::Result<Vec<u8>> {
        DiskFiles.read(path, most)
    }

    fn kind(&self, path: &Path) -> io::Result<FileKind> {
        let is_script = path.extension().is_some_and(|kind| kind == "bzz");
        match DiskFiles.kind(path) {
            Err(error) if is_script && error.kind() == ErrorKind::NotFound => {
                Ok(FileKind::File { length: 0 })
            }
            kind => kind,
        }
    }

    fn canonical(&self, path: &Path) -> Option<PathBuf> {
        DiskFiles.canonical(path)
    }

    fn names(&self, folder: &Path) -> Vec<String> {
        DiskFiles.names(folder)
    }
}
