//! The folder of a scenario, which contains the files that the scenario names.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use bittybuzz_compiler::include::{FileKind, Files};
use bittybuzz_toml_reader::file::{ReadError, TEXT_BYTES_MAX};

/// A folder on disk or in memory.
#[derive(Clone, Copy)]
pub struct Folder<'a> {
    /// The file system.
    pub files: &'a dyn Files,
    /// The path of the folder.
    pub path: &'a Path,
}

impl Folder<'_> {
    /// Returns the path of the file `name`, which is relative to the folder, or the reason why it
    /// is not a readable file. `most` is the largest length in bytes, if that is limited.
    pub fn file(&self, name: &str, most: Option<u64>) -> Result<PathBuf, String> {
        let path = self.path.join(name);
        match self.files.kind(&path) {
            Ok(FileKind::File { length }) => match most.filter(|most| length > *most) {
                None => Ok(path),
                Some(limit) => Err(ReadError::TooLarge { limit }.to_string()),
            },
            Ok(FileKind::Folder) => Err("it is a folder".to_owned()),
            Ok(FileKind::Stream) => Err("it is a device or a pipe".to_owned()),
            Err(error) if error.kind() == ErrorKind::NotFound => {
                Err("there is no such file".to_owned())
            }
            Err(error) => Err(error.to_string()),
        }
    }
}

/// Reads a text file that users write: a scenario or a robot file.
pub fn read_text(files: &dyn Files, path: &Path) -> Result<String, ReadError> {
    match files.kind(path)? {
        FileKind::Folder => return Err(ReadError::Folder),
        // A read could block forever.
        FileKind::Stream => return Err(ReadError::NotAFile("a device or a pipe")),
        FileKind::File { .. } => {}
    }
    let bytes = files.read(path, TEXT_BYTES_MAX as usize)?;
    if bytes.len() as u64 > TEXT_BYTES_MAX {
        return Err(ReadError::TooLarge { limit: TEXT_BYTES_MAX });
    }
    String::from_utf8(bytes).map_err(|_| ReadError::NotText)
}
