//! Files for other programs to read, for the time of a command.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::process;

use crate::problem::Problem;

/// A file that is gone when this value is.
pub struct Scratch(PathBuf);

impl Scratch {
    /// Returns a file, not there yet, that is named after the script and its content.
    pub fn new(script: &Path, content: &str) -> Self {
        let stem = script.file_stem().unwrap_or_default().to_string_lossy();
        Scratch(env::temp_dir().join(format!("bbz-{}-{stem}-{content}", process::id())))
    }

    /// Returns its path.
    pub fn path(&self) -> &Path {
        &self.0
    }

    /// Leaves it there.
    pub fn keep(self) {
        std::mem::forget(self);
    }

    /// Writes it.
    pub fn write(&self, bytes: &[u8]) -> Result<(), Problem> {
        fs::write(&self.0, bytes).map_err(|error| Problem::unwritable(&self.0, error))
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        // It may never have been written.
        let _ = fs::remove_file(&self.0);
    }
}
