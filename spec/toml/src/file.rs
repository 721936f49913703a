//! Reads files of limited size: every file that people or programs give to a command.

use std::fmt;
use std::fs::{self, File, FileType, OpenOptions};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// The limit for a text that people write, in bytes: scenarios, robot files.
pub const TEXT_BYTES_MAX: u64 = 4 << 20;

/// The limit for a Buzz object file, in bytes. An image has at most 64 KiB, so longer ones are no
/// script of a robot, and reading takes a thousand bytes of memory for each byte.
pub const OBJECT_BYTES_MAX: u64 = 1 << 20;

/// The limit for other files that a compiler made of a script, in bytes: images, symbols.
pub const COMPILED_BYTES_MAX: u64 = 64 << 20;

/// The limit for a program with the data of debuggers, in bytes: ELF, Intel hex.
pub const PROGRAM_BYTES_MAX: u64 = 256 << 20;

/// The limit for a recording of `bbz sim`, in bytes: three hours of 20,000 robots that all move,
/// with a sample each second.
pub const RECORDING_BYTES_MAX: u64 = 1 << 30;

/// The largest number of symbolic links that are followed, as in Linux.
const LINKS_MAX: usize = 40;

/// A reason why a file cannot be read, without its name.
#[derive(Debug)]
pub enum ReadError {
    /// The operating system returned an error.
    Io(io::Error),
    /// The path is a folder.
    Folder,
    /// The path is neither a file nor a folder: a pipe, device or socket, on which a program may
    /// wait for ever.
    NotAFile(&'static str),
    /// The path is a file of the system without an end, such as the log of the kernel.
    Waits,
    /// The file has more bytes than the limit.
    TooLarge {
        /// The limit in bytes.
        limit: u64,
    },
    /// The text is not UTF-8.
    NotText,
}

impl fmt::Display for ReadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ReadError::Io(error) => error.fmt(f),
            ReadError::Folder => write!(f, "it is a folder, not a file"),
            ReadError::NotAFile(kind) => write!(f, "it is {kind}, not a file"),
            ReadError::Waits => write!(f, "it waits for data, as a pipe does, and is not a file"),
            ReadError::TooLarge { limit } => {
                write!(f, "it has more than {} MiB, the limit for such a file", limit >> 20)
            }
            ReadError::NotText => write!(f, "it is not a text in UTF-8"),
        }
    }
}

impl std::error::Error for ReadError {}

impl From<io::Error> for ReadError {
    fn from(error: io::Error) -> Self {
        match error.kind() {
            io::ErrorKind::WouldBlock => ReadError::Waits,
            _ => ReadError::Io(error),
        }
    }
}

/// Reads a file of at most `limit` bytes.
pub fn read(path: &Path, limit: u64) -> Result<Vec<u8>, ReadError> {
    let file = open(path)?;
    let too_large = ReadError::TooLarge { limit };
    if file.metadata()?.len() > limit {
        return Err(too_large);
    }
    let mut bytes = Vec::new();
    // A stream has no length, and a file may grow between the two calls.
    file.take(limit + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > limit { Err(too_large) } else { Ok(bytes) }
}

/// Reads a text of at most `limit` bytes.
pub fn read_text(path: &Path, limit: u64) -> Result<String, ReadError> {
    String::from_utf8(read(path, limit)?).map_err(|_| ReadError::NotText)
}

/// Opens a file without waiting. Pipes and devices are refused unless they are streams that this
/// process was given, such as `/dev/stdin`.
pub fn open(path: &Path) -> Result<File, ReadError> {
    let kind = fs::metadata(path)?.file_type();
    if kind.is_dir() {
        return Err(ReadError::Folder);
    }
    if is_given_stream(path) {
        return Ok(File::open(path)?);
    }
    if !kind.is_file() {
        return Err(ReadError::NotAFile(name_of(kind)));
    }
    Ok(without_waiting(File::options().read(true)).open(path)?)
}

/// Lets reads fail that would wait. Regular files on disk never wait, but some of the system do,
/// such as `/proc/kmsg`, whose kind is that of a regular file.
#[cfg(all(target_os = "linux", any(target_arch = "x86_64", target_arch = "aarch64")))]
fn without_waiting(options: &mut OpenOptions) -> &mut OpenOptions {
    use std::os::unix::fs::OpenOptionsExt;

    // include/uapi/asm-generic/fcntl.h of Linux; the other architectures have other numbers.
    const O_NONBLOCK: i32 = 0o4000;
    options.custom_flags(O_NONBLOCK)
}

#[cfg(not(all(target_os = "linux", any(target_arch = "x86_64", target_arch = "aarch64"))))]
fn without_waiting(options: &mut OpenOptions) -> &mut OpenOptions {
    options
}

/// Returns true if the path leads, directly or over symbolic links, to a stream with which this
/// process was started.
pub fn is_given_stream(path: &Path) -> bool {
    let mut path = PathBuf::from(path);
    for _ in 0..LINKS_MAX {
        let streams = ["/dev/fd", "/proc/self/fd"];
        if path == Path::new("/dev/stdin") || streams.iter().any(|folder| path.starts_with(folder))
        {
            return true;
        }
        let Ok(target) = fs::read_link(&path) else { return false };
        // A relative target is relative to the folder of the link.
        path = path.parent().unwrap_or(Path::new("")).join(target);
    }
    false
}

/// Returns the name of a special file, for messages.
#[cfg(unix)]
pub fn name_of(kind: FileType) -> &'static str {
    use std::os::unix::fs::FileTypeExt;

    match kind {
        kind if kind.is_fifo() => "a pipe",
        kind if kind.is_socket() => "a socket",
        _ => "a device",
    }
}

/// Returns the name of a special file, for messages.
#[cfg(not(unix))]
pub fn name_of(_: FileType) -> &'static str {
    "a device"
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "what fails here fails the test")]
mod tests {
    use super::*;

    #[test]
    fn files_up_to_the_limit_are_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        fs::write(&path, b"1234").unwrap();
        assert_eq!(read(&path, 4).unwrap(), b"1234");
        assert!(matches!(read(&path, 3), Err(ReadError::TooLarge { limit: 3 })));
        fs::write(&path, [0xff]).unwrap();
        assert!(matches!(read_text(&path, 4), Err(ReadError::NotText)));
        fs::remove_file(&path).unwrap();
        assert!(matches!(read(&path, 4), Err(ReadError::Io(_))));
        assert!(matches!(read(folder.path(), 4), Err(ReadError::Folder)));
    }

    #[test]
    #[cfg(unix)]
    fn devices_are_no_files() {
        assert!(matches!(read(Path::new("/dev/zero"), 4), Err(ReadError::NotAFile("a device"))));
        assert!(
            is_given_stream(Path::new("/dev/stdin")) && is_given_stream(Path::new("/dev/fd/63"))
        );
        assert!(!is_given_stream(Path::new("/dev/null")) && !is_given_stream(Path::new("stdin")));
    }

    /// A pipe that this process has, and its path.
    #[cfg(target_os = "linux")]
    fn filled_pipe(content: &[u8]) -> (io::PipeReader, PathBuf) {
        use std::io::Write;
        use std::os::fd::AsRawFd;

        let (reader, mut writer) = io::pipe().unwrap();
        writer.write_all(content).unwrap();
        let path = PathBuf::from(format!("/proc/self/fd/{}", reader.as_raw_fd()));
        (reader, path)
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn streams_have_the_limit_of_files() {
        let (_pipe, path) = filled_pipe(b"1234");
        assert_eq!(read(&path, 4).unwrap(), b"1234");
        let (_pipe, path) = filled_pipe(b"12345");
        assert!(matches!(read(&path, 4), Err(ReadError::TooLarge { limit: 4 })));
    }

    #[test]
    #[cfg(unix)]
    fn relative_links_start_at_their_folder() {
        use std::os::unix::fs::symlink;

        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        symlink("/dev/stdin", folder.join("stream")).unwrap();
        symlink("stream", folder.join("link")).unwrap();
        symlink("/dev/null", folder.join("other")).unwrap();
        assert!(is_given_stream(&folder.join("link")));
        assert!(!is_given_stream(&folder.join("other")));
        // A circle of links leads nowhere.
        symlink("circle", folder.join("circle")).unwrap();
        assert!(!is_given_stream(&folder.join("circle")));
    }

    #[test]
    fn messages_name_the_limit() {
        let error = ReadError::TooLarge { limit: TEXT_BYTES_MAX };
        assert_eq!(error.to_string(), "it has more than 4 MiB, the limit for such a file");
    }
}
