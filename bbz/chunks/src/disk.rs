//! The operations on a folder of which the store is made.

use std::fs::{self, File};
use std::io::{self, ErrorKind, Write};
use std::path::PathBuf;

/// A folder. The operations are those of a file system, each alone, so that a test can lose any of
/// them as a loss of power does.
pub trait Disk {
    /// Returns the path of a file, for messages.
    fn path(&self, name: &str) -> PathBuf;
    /// Returns the names of all files.
    fn names(&self) -> io::Result<Vec<String>>;
    /// Returns the content of a file, or `None` if there is no such file.
    fn read(&self, name: &str) -> io::Result<Option<Vec<u8>>>;
    /// Creates a file that must not exist, and writes its content.
    fn create(&self, name: &str, bytes: &[u8]) -> io::Result<()>;
    /// Waits until the content of a file survives a loss of power.
    fn sync(&self, name: &str) -> io::Result<()>;
    /// Renames a file; an old file of the new name is replaced.
    fn rename(&self, from: &str, to: &str) -> io::Result<()>;
    /// Waits until the names in the folder survive a loss of power.
    fn sync_folder(&self) -> io::Result<()>;
    /// Removes a file, if there is one of that name.
    fn remove(&self, name: &str) -> io::Result<()>;
}

/// A folder of the operating system.
#[derive(Debug, Clone)]
pub struct Folder(pub PathBuf);

impl Disk for Folder {
    fn path(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    fn names(&self) -> io::Result<Vec<String>> {
        let names = fs::read_dir(&self.0)?.map(|entry| {
            // A name that is not UTF-8 has replacement characters, so it is none of the store's.
            entry.map(|entry| entry.file_name().to_string_lossy().into_owned())
        });
        names.collect()
    }

    fn read(&self, name: &str) -> io::Result<Option<Vec<u8>>> {
        match fs::read(self.path(name)) {
            Ok(bytes) => Ok(Some(bytes)),
            Err(error) => match error.kind() {
                // A file in place of the folder has no files in it.
                ErrorKind::NotFound | ErrorKind::NotADirectory => Ok(None),
                _ => Err(error),
            },
        }
    }

    fn create(&self, name: &str, bytes: &[u8]) -> io::Result<()> {
        File::create_new(self.path(name))?.write_all(bytes)
    }

    fn sync(&self, name: &str) -> io::Result<()> {
        // Windows syncs only files that are open for writing.
        File::options().write(true).open(self.path(name))?.sync_all()
    }

    fn rename(&self, from: &str, to: &str) -> io::Result<()> {
        fs::rename(self.path(from), self.path(to))
    }

    fn sync_folder(&self) -> io::Result<()> {
        // Windows syncs names together with the files.
        #[cfg(unix)]
        match File::open(&self.0).and_then(|folder| folder.sync_all()) {
            // Not every file system can sync a folder.
            Err(error)
                if matches!(error.kind(), ErrorKind::InvalidInput | ErrorKind::Unsupported) => {}
            other => other?,
        }
        Ok(())
    }

    fn remove(&self, name: &str) -> io::Result<()> {
        match fs::remove_file(self.path(name)) {
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(()),
            other => other,
        }
    }
}
