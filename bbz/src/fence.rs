//! Access to the files of chosen folders only, for scripts from other people and for a page.

use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use bittybuzz_compiler::include::{DiskFiles, FileKind, Files};

/// Some files on disk, and all below some folders. Links and `..` in a path do not lead out of them.
#[derive(Debug, Clone)]
pub struct Fence {
    /// Canonical paths.
    folders: Vec<PathBuf>,
    /// Canonical paths.
    files: BTreeSet<PathBuf>,
}

impl Fence {
    /// Allows the files below `folders`.
    pub fn new<'a>(folders: impl Iterator<Item = &'a Path>) -> Self {
        Fence { folders: Vec::new(), files: BTreeSet::new() }.with_folders(folders)
    }

    /// Also allows the files below more folders. A folder that does not exist is ignored.
    pub fn with_folders<'a>(mut self, folders: impl Iterator<Item = &'a Path>) -> Self {
        // Nothing can be read below a folder that does not exist.
        let canonical = |folder: &Path| fs::canonicalize(working_if_empty(folder)).ok();
        self.folders.extend(folders.filter_map(canonical));
        self
    }

    /// Also allows some files. Their paths are canonical.
    #[cfg(any(feature = "view", test))]
    pub fn with_files<'a>(mut self, files: impl Iterator<Item = &'a Path>) -> Self {
        self.files.extend(files.map(Path::to_owned));
        self
    }

    /// Returns an error if the file or folder at a path is none of those that are allowed. The error
    /// for a path outside does not depend on whether there is such a file.
    pub fn check(&self, path: &Path) -> io::Result<()> {
        let path = working_if_empty(path);
        match fs::canonicalize(path) {
            Ok(path) if self.is_allowed(&path) => Ok(()),
            Ok(_) => Err(outside()),
            Err(error) => {
                // A link that leads nowhere has no canonical path either, but a folder.
                let mut folders = path.ancestors().skip(1).map(working_if_empty);
                let nearest = folders.find_map(|folder| fs::canonicalize(folder).ok());
                let is_inside = nearest.is_some_and(|folder| self.is_allowed(&folder));
                Err(if is_inside { error } else { outside() })
            }
        }
    }

    fn is_allowed(&self, path: &Path) -> bool {
        self.files.contains(path) || self.folders.iter().any(|folder| path.starts_with(folder))
    }
}

fn outside() -> io::Error {
    let text = "it is outside of the scenario's folder and of the folders of `-I`";
    io::Error::new(io::ErrorKind::PermissionDenied, text)
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the message of an error.
    fn refusal(fence: &Fence, path: &Path) -> String {
        fence.check(path).unwrap_err().to_string()
    }

    #[test]
    fn an_error_does_not_tell_which_files_are_outside() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        for name in ["in", "out"] {
            fs::create_dir(at(name)).unwrap();
        }
        fs::write(at("out/secret.bzz"), "").unwrap();
        let fence = Fence::new([at("in")].iter().map(PathBuf::as_path));
        let outside = outside().to_string();
        for name in ["out/secret.bzz", "out/missing.bzz", "in/../out/secret.bzz", "no/such", "out"]
        {
            assert_eq!(refusal(&fence, &at(name)), outside, "{name}");
        }
        for name in ["in/missing.bzz", "in/missing/../../out/secret.bzz"] {
            assert_eq!(fence.check(&at(name)).unwrap_err().kind(), io::ErrorKind::NotFound);
        }
        // The beginning of a name is no folder.
        fs::create_dir(at("inside")).unwrap();
        assert_eq!(refusal(&fence, &at("inside")), outside);
        assert!(fence.check(&at("in")).is_ok() && fence.check(&at("out/../in")).is_ok());
        let one = fs::canonicalize(at("out/secret.bzz")).unwrap();
        let fence = fence.with_files([one.as_path()].into_iter());
        assert!(fence.check(&at("out/secret.bzz")).is_ok());
        assert_eq!(refusal(&fence, &at("out/other.bzz")), outside);
    }

    #[cfg(unix)]
    #[test]
    fn links_do_not_lead_out() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        for name in ["in", "out"] {
            fs::create_dir(at(name)).unwrap();
        }
        fs::write(at("out/secret.bzz"), "").unwrap();
        std::os::unix::fs::symlink(at("out/secret.bzz"), at("in/link.bzz")).unwrap();
        std::os::unix::fs::symlink(at("out"), at("in/sub")).unwrap();
        let fence = Fence::new([at("in")].iter().map(PathBuf::as_path));
        for name in ["in/link.bzz", "in/sub/secret.bzz", "in/sub/missing.bzz"] {
            assert_eq!(refusal(&fence, &at(name)), outside().to_string(), "{name}");
        }
    }
}
