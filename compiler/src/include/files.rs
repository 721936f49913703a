//! Access to files on disk, or in memory for tests, editors and web pages.

use std::collections::BTreeMap;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// The file operations that the compiler and the simulator need.
pub trait Files {
    /// Returns the bytes of a file. For a file with more than `most` bytes, the result may be cut
    /// off after `most` + 1 bytes.
    fn read(&self, path: &Path, most: usize) -> io::Result<Vec<u8>>;

    /// Returns the kind of file at a path.
    fn kind(&self, path: &Path) -> io::Result<FileKind>;

    /// Returns the one canonical path of an existing file, or `None` if there is no such file.
    fn canonical(&self, path: &Path) -> Option<PathBuf>;

    /// Returns the names of the files in a folder, from which a misspelt name is corrected.
    fn names(&self, folder: &Path) -> Vec<String>;
}

/// A kind of file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FileKind {
    /// A file.
    File {
        /// The length in bytes.
        length: u64,
    },
    /// A folder.
    Folder,
    /// A device, a pipe or a socket.
    Stream,
}

/// The files on disk.
#[derive(Debug, Clone, Copy, Default)]
pub struct DiskFiles;

impl Files for DiskFiles {
    fn read(&self, path: &Path, most: usize) -> io::Result<Vec<u8>> {
        let mut options = File::options();
        options.read(true);
        if fs::metadata(path)?.is_file() {
            without_waiting(&mut options);
        }
        let mut bytes = Vec::new();
        options.open(path)?.take(most as u64 + 1).read_to_end(&mut bytes).map_err(|error| {
            match error.kind() {
                io::ErrorKind::WouldBlock => io::Error::new(error.kind(), WAITS),
                _ => error,
            }
        })?;
        Ok(bytes)
    }

    fn kind(&self, path: &Path) -> io::Result<FileKind> {
        let metadata = fs::metadata(path)?;
        Ok(match metadata.is_dir() {
            true => FileKind::Folder,
            false if metadata.is_file() => FileKind::File { length: metadata.len() },
            false => FileKind::Stream,
        })
    }

    fn canonical(&self, path: &Path) -> Option<PathBuf> {
        fs::canonicalize(path).ok().filter(|path| path.is_file())
    }

    fn names(&self, folder: &Path) -> Vec<String> {
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        let Ok(entries) = fs::read_dir(folder) else { return Vec::new() };
        entries.flatten().filter_map(|entry| entry.file_name().into_string().ok()).collect()
    }
}

/// The error of a file such as `/proc/kmsg`, whose kind is that of a regular file.
const WAITS: &str = "it waits for data, as a pipe does, and is not a file";

/// Lets reads fail that would wait. `bittybuzz_toml_reader::file` has the same function; the compiler
/// does without that crate.
#[cfg(all(target_os = "linux", any(target_arch = "x86_64", target_arch = "aarch64")))]
fn without_waiting(options: &mut OpenOptions) {
    use std::os::unix::fs::OpenOptionsExt;

    // include/uapi/asm-generic/fcntl.h of Linux; the other architectures have other numbers.
    const O_NONBLOCK: i32 = 0o4000;
    options.custom_flags(O_NONBLOCK);
}

#[cfg(not(all(target_os = "linux", any(target_arch = "x86_64", target_arch = "aarch64"))))]
fn without_waiting(_: &mut OpenOptions) {}

/// Files held in memory. A file without content exists but cannot be read.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct MemoryFiles {
    files: BTreeMap<PathBuf, Option<Vec<u8>>>,
}

impl MemoryFiles {
    /// Adds a file.
    pub fn with(mut self, path: impl AsRef<Path>, content: impl Into<Vec<u8>>) -> Self {
        self.files.insert(normal(path.as_ref()), Some(content.into()));
        self
    }

    /// Adds a file that cannot be read.
    pub fn with_unreadable(mut self, path: impl AsRef<Path>) -> Self {
        self.files.insert(normal(path.as_ref()), None);
        self
    }

    /// Returns true if there is a file at a path.
    pub fn contains(&self, path: &Path) -> bool {
        self.files.contains_key(&normal(path))
    }

    /// Returns true if there is no file.
    pub fn is_empty(&self) -> bool {
        self.files.is_empty()
    }
}

impl Files for MemoryFiles {
    fn read(&self, path: &Path, _: usize) -> io::Result<Vec<u8>> {
        match self.files.get(&normal(path)) {
            Some(Some(content)) => Ok(content.clone()),
            Some(None) => Err(io::ErrorKind::PermissionDenied.into()),
            None => Err(not_found()),
        }
    }

    fn kind(&self, path: &Path) -> io::Result<FileKind> {
        let path = normal(path);
        match self.files.get(&path) {
            Some(content) => {
                let length = content.as_ref().map_or(0, |content| content.len() as u64);
                Ok(FileKind::File { length })
            }
            None if self.files.keys().any(|file| file.starts_with(&path)) => Ok(FileKind::Folder),
            None => Err(not_found()),
        }
    }

    fn canonical(&self, path: &Path) -> Option<PathBuf> {
        self.contains(path).then(|| normal(path))
    }

    fn names(&self, folder: &Path) -> Vec<String> {
        let folder = normal(folder);
        let inside = self.files.keys().filter(|path| path.parent() == Some(&folder));
        inside.filter_map(|path| path.file_name()?.to_str().map(str::to_owned)).collect()
    }
}

/// Files in memory that take the place of other files with the same paths.
pub struct OverlaidFiles<'a> {
    /// The files that count first.
    pub over: &'a MemoryFiles,
    /// The files for all other paths.
    pub below: &'a dyn Files,
}

impl OverlaidFiles<'_> {
    /// Returns the files to ask about a path.
    fn of(&self, path: &Path) -> &dyn Files {
        if self.over.contains(path) { self.over } else { self.below }
    }
}

impl Files for OverlaidFiles<'_> {
    fn read(&self, path: &Path, most: usize) -> io::Result<Vec<u8>> {
        self.of(path).read(path, most)
    }

    fn kind(&self, path: &Path) -> io::Result<FileKind> {
        self.of(path).kind(path)
    }

    fn canonical(&self, path: &Path) -> Option<PathBuf> {
        self.of(path).canonical(path)
    }

    fn names(&self, folder: &Path) -> Vec<String> {
        let mut names = self.over.names(folder);
        names.extend(self.below.names(folder));
        names
    }
}

/// Returns the error for a missing file, with a message for people, because no operating system
/// provides one here.
fn not_found() -> io::Error {
    io::Error::new(io::ErrorKind::NotFound, "there is no such file")
}

/// Returns the path with `.` and `..` resolved, without a look at a disk.
pub fn normal(path: &Path) -> PathBuf {
    use std::path::Component;
    let mut result = PathBuf::new();
    for component in path.components() {
        match component {
            Component::CurDir => {}
            Component::ParentDir if result.file_name().is_some() => {
                result.pop();
            }
            other => result.push(other),
        }
    }
    result
}
