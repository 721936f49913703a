//! Temporary files that other programs read during a command.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::process;

use crate::file_error::FileError;

/// A temporary file, which is removed when this value is dropped.
pub struct ScratchFile(PathBuf);

impl ScratchFile {
    /// Names a file in the temporary folder after the script and its content. Does not create it.
    pub fn new(script: &Path, content: &str) -> Self {
        let stem = script.file_stem().unwrap_or_default().to_string_lossy();
        ScratchFile(env::temp_dir().join(format!("bbz-{}-{stem}-{content}", process::id())))
    }

    /// Returns the path of the file.
    pub fn path(&self) -> &Path {
        &self.0
    }

    /// Keeps the file on disk.
    pub fn keep(self) {
        std::mem::forget(self);
    }

    /// Writes the file.
    pub fn write(&self, bytes: &[u8]) -> Result<(), FileError> {
        fs::write(&self.0, bytes).map_err(|error| FileError::writing(&self.0, error))
    }
}

impl Drop for ScratchFile {
    fn drop(&mut self) {
        // The file may never have been written.
        let _ = fs::remove_file(&self.0);
    }
}
