//! Access to the files of chosen folders only, for scripts from other people.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use bittybuzz_compiler::include::{DiskFiles, FileKind, Files};

/// The files on disk below some folders. Links and `..` in a path do not lead out of them.
#[derive(Debug, Clone)]
pub struct Fence {
    /// Canonical paths.
    folders: Vec<PathBuf>,
}

impl Fence {
    /// Allows the files below `folders`. A folder that does not exist is ignored.
    pub fn new<'a>(folders: impl Iterator<Item = &'a Path>) -> Self {
        // Nothing can be read below a folder that does not exist.
        let canonical = |folder: &Path| fs::canonicalize(working_if_empty(folder)).ok();
        Fence { folders: folders.filter_map(canonical).collect() }
    }

    /// Returns an error if the file or folder at a path is outside all folders.
    fn check(&self, path: &Path) -> io::Result<()> {
        let path = fs::canonicalize(working_if_empty(path))?;
        match self.folders.iter().any(|folder| path.starts_with(folder)) {
            true => Ok(()),
            false => Err(io::ErrorKind::PermissionDenied.into()),
        }
    }
}

/// Returns the working folder for an empty path.
fn working_if_empty(folder: &Path) -> &Path {
    if folder.as_os_str().is_empty() { Path::new(".") } else { folder }
}

impl Files for Fence {
    fn read(&self, path: &Path, most: usize) -> io::Result<Vec<u8>> {
        self.check(path)?;
        DiskFiles.read(path, most)
    }

    fn kind(&self, path: &Path) -> io::Result<FileKind> {
        self.check(path)?;
        DiskFiles.kind(path)
    }

    fn canonical(&self, path: &Path) -> Option<PathBuf> {
        self.check(path).ok()?;
        DiskFiles.canonical(path)
    }

    fn names(&self, folder: &Path) -> Vec<String> {
        self.check(folder).map_or_else(|_| Vec::new(), |()| DiskFiles.names(folder))
    }
}
