//! Files that a command writes: whole or not at all, and never over a file that it reads.

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::process;

use bittybuzz_toml_reader::file;

use crate::file_error::FileError;

/// The files that a command reads.
#[derive(Debug, Default)]
pub struct Inputs(BTreeSet<PathBuf>);

impl Inputs {
    /// Adds a file, if there is one of that name.
    pub fn add(&mut self, path: &Path) {
        // Terminals and pipes may be both read and written.
        if path.is_file()
            && let Ok(path) = fs::canonicalize(path)
        {
            self.0.insert(path);
        }
    }

    /// Returns the files, each once.
    pub fn paths(&self) -> impl Iterator<Item = &Path> {
        self.0.iter().map(PathBuf::as_path)
    }

    /// Returns an error if the output is one of the inputs.
    pub fn refuse(&self, output: &Path) -> Result<(), FileError> {
        match fs::canonicalize(output) {
            Ok(path) if self.0.contains(&path) => Err(FileError::ReadAndWritten(output.to_owned())),
            _ => Ok(()),
        }
    }
}

/// A file that is written under a temporary name next to its destination, and renamed when it is
/// complete. Until then, and after a failure, the old file remains.
pub struct WholeFile {
    /// The name on the command line, for messages.
    path: PathBuf,
    /// The temporary file and its destination; `None` for a device or pipe, which is written
    /// directly.
    aside: Option<(PathBuf, PathBuf)>,
    file: BufWriter<File>,
}

impl WholeFile {
    /// Creates the temporary file next to its destination.
    pub fn create(path: &Path) -> Result<Self, FileError> {
        let unwritable = |error| FileError::writing(path, error);
        // The target of a symbolic link is replaced, not the link.
        let place = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
        if path.is_dir() {
            return Err(unwritable(io::ErrorKind::IsADirectory.into()));
        }
        let (file, aside) = match is_stream(path) {
            true => (File::options().write(true).open(path), None),
            false => {
                let (file, aside) = create_aside(&place);
                (file, Some((aside, place)))
            }
        };
        let file = BufWriter::new(file.map_err(unwritable)?);
        Ok(WholeFile { path: path.to_owned(), aside, file })
    }

    /// Moves the complete file to its destination.
    pub fn finish(mut self) -> Result<(), FileError> {
        let finished = self.file.flush().and_then(|()| {
            let Some((aside, place)) = &self.aside else { return Ok(()) };
            self.file.get_ref().sync_all()?;
            fs::rename(aside, place)
        });
        finished.map_err(|error| FileError::writing(&self.path, error))?;
        self.aside = None;
        Ok(())
    }
}

impl Write for WholeFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Drop for WholeFile {
    fn drop(&mut self) {
        if let Some((aside, _)) = &self.aside {
            // The file may have been removed already.
            let _ = fs::remove_file(aside);
        }
    }
}

/// Creates a file next to `place`, under an unused name. The file of a killed process may remain
/// there, and its process id may be used again.
fn create_aside(place: &Path) -> (io::Result<File>, PathBuf) {
    let mut number = process::id();
    loop {
        let aside = with_suffix(place, &format!(".{number}"));
        let file = File::create_new(&aside);
        match &file {
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {
                number = number.wrapping_add(1);
            }
            _ => return (file, aside),
        }
    }
}

/// Returns true for a device or pipe, which is written directly and keeps nothing.
pub fn is_stream(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|metadata| !metadata.is_file()) || file::is_given_stream(path)
}

/// Writes a file whole or not at all.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), FileError> {
    let mut file = WholeFile::create(path)?;
    file.write_all(bytes).map_err(|error| FileError::writing(path, error))?;
    file.finish()
}

/// Returns the path with `suffix` after its last character.
pub fn with_suffix(path: &Path, suffix: &str) -> PathBuf {
    let mut path = OsString::from(path);
    path.push(suffix);
    PathBuf::from(path)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "what fails here fails the test")]
mod tests {
    use super::*;

    #[test]
    fn the_file_of_a_killed_process_is_left_alone() {
        let folder = std::env::temp_dir().join(format!("bbz-whole-file-{}", process::id()));
        fs::create_dir(&folder).unwrap();
        let place = folder.join("run.bbr");
        let left = with_suffix(&place, &format!(".{}", process::id()));
        fs::write(&left, "left").unwrap();
        write(&place, b"new").unwrap();
        assert_eq!(fs::read(&place).unwrap(), b"new");
        assert_eq!(fs::read(&left).unwrap(), b"left");
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 2);
        fs::remove_dir_all(&folder).unwrap();
    }
}
