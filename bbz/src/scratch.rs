//! Temporary files that other programs read during a command.

use std::env;
use std::io::Write;
use std::path::Path;

use tempfile::{Builder, NamedTempFile};

use crate::file_error::FileError;

/// A temporary file, which is removed when this value is dropped.
///
/// The folder for temporary files belongs to all users. The name is therefore random, and the file
/// is created only if there is nothing of that name, so that nobody can place a link there first.
pub struct ScratchFile(NamedTempFile);

impl ScratchFile {
    /// Creates an empty file in the temporary folder, whose name ends with that of the script and
    /// its content.
    pub fn create(script: &Path, content: &str) -> Result<Self, FileError> {
        let stem = script.file_stem().expect("a path of a file that was read has a name");
        let stem = stem.to_string_lossy();
        let file = Builder::new().prefix("bbz-").suffix(&format!("-{stem}-{content}")).tempfile();
        file.map(ScratchFile).map_err(|error| FileError::writing(&env::temp_dir(), error))
    }

    /// Returns the path of the file.
    pub fn path(&self) -> &Path {
        self.0.path()
    }

    /// Keeps the file on disk.
    pub fn keep(mut self) {
        self.0.disable_cleanup(true);
    }

    /// Writes the file.
    pub fn write(&self, bytes: &[u8]) -> Result<(), FileError> {
        self.0.as_file().write_all(bytes).map_err(|error| FileError::writing(self.path(), error))
    }
}
