//! Files that a command writes: whole or not at all, and never over a file that it reads.

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use bittybuzz_toml_reader::file;
use tempfile::TempPath;

use crate::file_error::FileError;
use crate::unfinished;

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
    /// The temporary file, which is removed when it is dropped, and its destination; `None` for a
    /// device or pipe, which is written directly.
    aside: Option<(TempPath, PathBuf)>,
    file: BufWriter<File>,
}

impl WholeFile {
    /// Creates the temporary file next to its destination, and clears away or names those of
    /// processes that were killed while they wrote it.
    pub fn create(path: &Path) -> Result<Self, FileError> {
        if !path.is_dir() && !is_stream(path) {
            unfinished::clear(path, &place(path));
        }
        let unwritable = |error| FileError::writing(path, error);
        if path.is_dir() {
            return Err(unwritable(io::ErrorKind::IsADirectory.into()));
        }
        let place = place(path);
        let (file, aside) = match is_stream(path) {
            true => (open_stream(path)?, None),
            false => {
                let (file, aside) = unfinished::create(&place).map_err(unwritable)?.into_parts();
                (file, Some((aside, place)))
            }
        };
        Ok(WholeFile { path: path.to_owned(), aside, file: BufWriter::new(file) })
    }

    /// Moves the complete file to its destination.
    pub fn finish(self) -> Result<(), FileError> {
        let WholeFile { path, aside, mut file } = self;
        let finished = file.flush().and_then(|()| match aside {
            Some((aside, place)) => {
                file.get_ref().sync_all()?;
                Ok(aside.persist(place)?)
            }
            None => Ok(()),
        });
        finished.map_err(|error| FileError::writing(&path, error))
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

/// Returns the path of the file that is replaced: the target of a symbolic link, not the link. A
/// file that does not exist yet has no other path.
fn place(path: &Path) -> PathBuf {
    fs::canonicalize(path).unwrap_or_else(|_| path.to_owned())
}

/// Returns true for a device or pipe, which is written directly and keeps nothing.
pub fn is_stream(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|metadata| !metadata.is_file()) || file::is_given_stream(path)
}

/// Opens a device, or a pipe that has a reader.
#[cfg(unix)]
fn open_stream(path: &Path) -> Result<File, FileError> {
    use std::os::unix::fs::{FileTypeExt, OpenOptionsExt};

    use nix::errno::Errno;
    use nix::fcntl::{FcntlArg, OFlag, fcntl};

    let unwritable = |error| FileError::writing(path, error);
    let kind = fs::metadata(path).map_err(unwritable)?.file_type();
    if kind.is_socket() || kind.is_block_device() {
        return Err(FileError::Special { path: path.to_owned(), kind: file::name_of(kind) });
    }
    let mut options = File::options();
    options.write(true);
    if !kind.is_fifo() {
        return options.open(path).map_err(unwritable);
    }
    // fifo(7): without this flag, the call waits for a reader; with it, ENXIO says that there is
    // none.
    options.custom_flags(OFlag::O_NONBLOCK.bits());
    let pipe = options.open(path).map_err(|error| match error.raw_os_error() {
        Some(number) if number == Errno::ENXIO as i32 => FileError::Unread(path.to_owned()),
        _ => unwritable(error),
    })?;
    // From here on a full pipe waits for its reader. F_SETFL changes no other flag that `open` sets.
    fcntl(&pipe, FcntlArg::F_SETFL(OFlag::empty()))
        .map_err(|errno| unwritable(io::Error::from(errno)))?;
    Ok(pipe)
}

/// Opens a device or pipe.
#[cfg(not(unix))]
fn open_stream(path: &Path) -> Result<File, FileError> {
    File::options().write(true).open(path).map_err(|error| FileError::writing(path, error))
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
mod tests {
    use super::*;

    #[test]
    fn an_unfinished_file_is_removed() {
        let folder = tempfile::tempdir().unwrap();
        let place = folder.path().join("run.bbr");
        let unfinished = WholeFile::create(&place).unwrap();
        let names = || fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().file_name());
        let names: Vec<String> = names().map(|name| name.into_string().unwrap()).collect();
        assert!(
            matches!(&names[..], [name] if name.starts_with("run.bbr.unfinished-bbz-")),
            "{names:?}"
        );
        drop(unfinished);
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 0);
    }

    /// A result is as readable as a file that any other program creates.
    #[cfg(unix)]
    #[test]
    fn a_result_has_the_mode_of_the_umask() {
        use std::os::unix::fs::PermissionsExt;

        let folder = tempfile::tempdir().unwrap();
        let [usual, result] = ["usual", "result"].map(|name| folder.path().join(name));
        fs::write(&usual, "").unwrap();
        write(&result, b"").unwrap();
        let mode = |path| fs::metadata(path).unwrap().permissions().mode() & 0o7777;
        assert_eq!(mode(&result), mode(&usual));
    }
}
