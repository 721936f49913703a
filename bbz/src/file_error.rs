//! Errors of reading and writing files, which all commands can meet.

use std::io;
use std::path::{Path, PathBuf};

use bittybuzz_toml_reader::file::ReadError;

use crate::problem::Problem;

/// The similarity from which on a name is suggested, of 0 to 1.
const SIMILARITY_MIN: f64 = 0.85;

/// A reason why a file cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    #[error("there is no file `{0}`")]
    Missing(PathBuf),
    #[error("no permission to read `{0}`")]
    Forbidden(PathBuf),
    /// A folder where a file is needed.
    #[error("`{0}` is a folder, not a file")]
    Folder(PathBuf),
    /// The file cannot be read for another reason.
    #[error("cannot read `{path}`: {error}")]
    Unreadable { path: PathBuf, error: ReadError },
    #[error("cannot write `{path}`: {error}")]
    Unwritable { path: PathBuf, error: io::Error },
    /// A pipe without a reader, on which a command would wait without end.
    #[cfg_attr(not(unix), expect(dead_code, reason = "other systems open no such file"))]
    #[error("cannot write `{0}`: `{0}` is a pipe that no program reads")]
    Unread(PathBuf),
    /// A socket or disk.
    #[cfg_attr(not(unix), expect(dead_code, reason = "other systems open no such file"))]
    #[error("cannot write `{path}`: `{path}` is {kind}, not a file")]
    Special { path: PathBuf, kind: &'static str },
    /// The output file is also read by the same command.
    #[error("`{0}` is read by this command, and would be replaced")]
    ReadAndWritten(PathBuf),
}

impl FileError {
    /// Returns the error of a file that cannot be read.
    pub fn reading(path: &Path, error: impl Into<ReadError>) -> FileError {
        let path = path.to_owned();
        match error.into() {
            ReadError::Folder => FileError::Folder(path),
            ReadError::Io(error) if error.kind() == io::ErrorKind::NotFound => {
                FileError::Missing(path)
            }
            ReadError::Io(error) if error.kind() == io::ErrorKind::PermissionDenied => {
                FileError::Forbidden(path)
            }
            error => FileError::Unreadable { path, error },
        }
    }

    /// Returns the error of a file that cannot be written.
    pub fn writing(path: &Path, error: io::Error) -> FileError {
        FileError::Unwritable { path: path.to_owned(), error }
    }
}

impl Problem for FileError {
    fn help(&self) -> Option<String> {
        match self {
            FileError::Missing(path) => {
                likely_file(path).map(|likely| format!("did you mean `{}`?", likely.display()))
            }
            FileError::Folder(_) => Some("name a file in it".to_owned()),
            FileError::ReadAndWritten(_) => Some("name another file".to_owned()),
            FileError::Unread(_) => Some("start its reader first, or name a file".to_owned()),
            FileError::Special { .. } => {
                Some("name a file, or a pipe that a program reads".to_owned())
            }
            FileError::Forbidden(_)
            | FileError::Unreadable { .. }
            | FileError::Unwritable { .. } => None,
        }
    }
}

/// Returns the file next to the missing one whose name is most similar.
fn likely_file(path: &Path) -> Option<PathBuf> {
    let wanted = path.file_name()?.to_str()?;
    let folder = path.parent()?;
    let searched = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    // The error is about another file: names that cannot be read are only not suggested.
    let names = searched.read_dir().ok()?.flatten().filter_map(|entry| {
        let name = entry.file_name().into_string().ok()?;
        ([".bzz", ".bo", ".bbi", ".toml", ".argos"].iter().any(|end| name.ends_with(end)))
            .then_some(name)
    });
    let scored = names.map(|name| (strsim::jaro_winkler(wanted, &name), name));
    let best = scored.max_by(|a, b| a.0.total_cmp(&b.0))?;
    (best.0 > SIMILARITY_MIN).then(|| folder.join(best.1))
}
