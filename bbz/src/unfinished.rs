//! Temporary files of outputs, and those that killed processes leave.
//!
//! A process holds an advisory lock on its temporary file as long as it writes. The operating
//! system releases the lock when the process ends, so a temporary file without a lock has no
//! writer. A file whose lock cannot be asked for, as on some network drives, is left alone.

use std::ffi::{OsStr, OsString};
use std::fs::{self, File, TryLockError};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use annotate_snippets::{Group, Level};
use bittybuzz_arena::output::recording::RecordingReader;
use tempfile::{Builder, NamedTempFile};

use crate::{launch, report};

/// The middle of the name of a temporary file, between the name of its destination and random
/// characters. No program but `bbz` gives such names, so files of others are never removed.
const MARK: &str = ".unfinished-bbz-";

/// The number of random characters.
const RANDOM: usize = 8;

/// The most bytes that are read to find the first sample of a recording: the header of 65,536
/// robots, and one sample of them, have less than 2 MiB.
const HEAD_BYTES_MAX: u64 = 4 << 20;

/// The attempts to create a file, of which each fails only if another process clears the folder
/// between two calls.
const ATTEMPTS: usize = 10;

/// Creates a locked temporary file next to `place`.
pub fn create(place: &Path) -> io::Result<NamedTempFile> {
    let (Some(folder), Some(prefix)) = (place.parent(), prefix(place)) else {
        return Err(io::ErrorKind::InvalidFilename.into());
    };
    let mut builder = Builder::new();
    builder.prefix(&prefix).rand_bytes(RANDOM);
    // The umask of the user decides who may read a result, as with any new file. Temporary files
    // are otherwise readable by their owner alone.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    for _ in 0..ATTEMPTS {
        let file = builder.tempfile_in(or_here(folder))?;
        // Another process that clears the folder may have seen the file before it was locked: it
        // then holds the lock, or has removed the file.
        let is_taken = matches!(file.as_file().try_lock(), Err(TryLockError::WouldBlock));
        if !is_taken && file.path().exists() {
            return Ok(file);
        }
    }
    Err(io::ErrorKind::ResourceBusy.into())
}

/// Removes the temporary files of killed processes that were to replace `place`, and names those
/// that hold samples of a recording. Messages name them next to `path`, as on the command line.
pub fn clear(path: &Path, place: &Path) {
    for file in left(place) {
        // A file of another user, or on a drive that went away, concerns this command not.
        let Some(held) = lock(&file) else { continue };
        let Some(name) = file.file_name() else { continue };
        match has_samples(&held) {
            true => name_recording(path, &path.with_file_name(name)),
            false => drop(fs::remove_file(&file)),
        }
    }
}

/// Returns the temporary files next to `place`, sorted.
fn left(place: &Path) -> Vec<PathBuf> {
    let (Some(folder), Some(prefix)) = (place.parent(), prefix(place)) else { return Vec::new() };
    let Ok(entries) = fs::read_dir(or_here(folder)) else { return Vec::new() };
    let is_temporary = |name: &OsString| {
        name.as_encoded_bytes().strip_prefix(prefix.as_encoded_bytes()).is_some_and(|random| {
            random.len() == RANDOM && random.iter().all(u8::is_ascii_alphanumeric)
        })
    };
    let names = entries.flatten().map(|entry| entry.file_name()).filter(is_temporary);
    let mut files: Vec<PathBuf> = names.map(|name| place.with_file_name(name)).collect();
    files.sort();
    files
}

/// Opens and locks a file; `None` if it has a writer, or if that is unknown.
fn lock(path: &Path) -> Option<File> {
    // Another user may have put a pipe or a link there, on which opening would wait.
    fs::symlink_metadata(path).ok()?.is_file().then_some(())?;
    let file = File::open(path).ok()?;
    file.try_lock().ok()?;
    Some(file)
}

/// Returns true for a recording from which at least one sample can be shown.
fn has_samples(mut file: &File) -> bool {
    let mut bytes = Vec::new();
    if file.by_ref().take(HEAD_BYTES_MAX).read_to_end(&mut bytes).is_err() {
        return false;
    }
    RecordingReader::new(&bytes).is_ok_and(|mut samples| matches!(samples.next(), Some(Ok(_))))
}

fn name_recording(path: &Path, file: &Path) {
    let title = format!(
        "`{}` is what a `bbz` that was killed recorded for `{}`",
        file.display(),
        path.display()
    );
    let command = launch::command([OsStr::new("view"), file.as_os_str()]);
    let advice = format!("`{command}` shows it up to its end; delete it if you do not need it");
    report::print(Group::with_title(Level::NOTE.primary_title(title)));
    report::print(Group::with_title(Level::HELP.primary_title(advice)));
}

/// Returns the start of the names of temporary files; `None` for a path without a file name.
fn prefix(place: &Path) -> Option<OsString> {
    let mut prefix = place.file_name()?.to_owned();
    prefix.push(MARK);
    Some(prefix)
}

fn or_here(folder: &Path) -> &Path {
    if folder.as_os_str().is_empty() { Path::new(".") } else { folder }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_with_a_writer_and_files_of_others_stay() {
        let folder = tempfile::tempdir().unwrap();
        let place = folder.path().join("run.bbr");
        let written = create(&place).unwrap();
        let others =
            ["run.bbr.backup", "run.bbr.unfinished-bbz-", "run.bbr.unfinished-bbz-mine.txt"];
        for name in others.into_iter().chain(["run.bbr.unfinished-bbz-a1B2c3D4", "x.bbr"]) {
            fs::write(folder.path().join(name), "").unwrap();
        }
        clear(&place, &place);
        assert!(written.path().exists());
        for name in others {
            assert!(folder.path().join(name).exists(), "{name}");
        }
        assert!(!folder.path().join("run.bbr.unfinished-bbz-a1B2c3D4").exists());
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 5);
        assert_eq!(left(&place), [written.path()]);
    }

    /// A link may lead to a pipe, a device, or a file that is locked for another reason.
    #[cfg(unix)]
    #[test]
    fn links_stay() {
        let folder = tempfile::tempdir().unwrap();
        let place = folder.path().join("run.bbr");
        let link = folder.path().join("run.bbr.unfinished-bbz-a1B2c3D4");
        std::os::unix::fs::symlink("/dev/zero", &link).unwrap();
        clear(&place, &place);
        assert!(fs::symlink_metadata(&link).is_ok());
    }
}
