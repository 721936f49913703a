//! The configuration of the search for included files.

use std::path::PathBuf;

use super::files::Files;

/// The folder in messages about files of the shipped library: `<library>/vec2.bzz`.
pub const LIBRARY_FOLDER: &str = "<library>";

/// The configuration of the search for included files. The search order is the folder of the
/// including file, the working folder, then the lists below.
pub struct IncludeLoader<'a> {
    /// The file system, or a replacement for it.
    pub files: &'a dyn Files,
    /// The folder the compiler was started in; relative paths of the main script start here.
    pub working_folder: PathBuf,
    /// The folders given with `-I`.
    pub folders: Vec<PathBuf>,
    /// The folders listed in the environment variable `BUZZ_INCLUDE_PATH`.
    pub environment: Vec<PathBuf>,
    /// The shipped library: file name and text.
    pub library: &'a [(&'a str, &'a str)],
}

impl<'a> IncludeLoader<'a> {
    /// Creates a loader that searches only the folder of the including file and the working folder.
    pub fn new(files: &'a dyn Files) -> Self {
        IncludeLoader {
            files,
            working_folder: PathBuf::new(),
            folders: Vec::new(),
            environment: Vec::new(),
            library: &[],
        }
    }
}
