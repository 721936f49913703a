//! The journal of a batch: a folder next to the table, in which finished runs wait until all are
//! finished, and from which an interrupted batch resumes.
//!
//! `FILE.parts` is the folder of a sweep (crate `bittybuzz-chunks`), and `lock`, which the process that
//! writes holds: at its end, the batch removes the folder. The operating system releases the lock when the
//! process ends.

use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

use bittybuzz_chunks::{Folder, Found, Store};

use crate::chunks::{Names, StoreProblem};
use crate::file_error::FileError;
use crate::problem::Problem;
use crate::whole_file;

use super::experiment;
use super::study::Study;

/// A reason why finished runs cannot be kept, or read.
#[derive(Debug, thiserror::Error)]
enum JournalError {
    /// The folder for the journal of a batch holds other files.
    #[error("`{0}` is where finished runs are kept, and holds other files")]
    Folder(PathBuf),
    /// Another process is working on the batch.
    #[error("another `bbz` is at work on the runs in `{0}`")]
    Busy(PathBuf),
    /// The batch was stopped before, and is not to be resumed.
    #[error("`{0}` has finished runs of a batch that was stopped")]
    Unfinished(PathBuf),
}

impl Problem for JournalError {
    fn help(&self) -> Option<String> {
        let help = match self {
            JournalError::Folder(_) => "name another file for the table, or move the folder",
            JournalError::Busy(_) => "wait for it, or name another file for the table",
            JournalError::Unfinished(_) => {
                "--resume goes on with it; to start again, remove the folder"
            }
        };
        Some(help.to_owned())
    }
}

const LOCK: &str = "lock";

/// The most chunks of a batch. More chunks would lose fewer runs when the process is killed, but take
/// more files.
const CHUNKS_MAX: usize = 1000;

/// Returns the number of runs of a chunk, for a batch with this number of runs.
pub fn chunk(runs: usize) -> u32 {
    runs.div_ceil(CHUNKS_MAX).max(1) as u32
}

/// The folder of a batch that is under way.
pub struct Journal {
    folder: PathBuf,
    pub store: Store<Folder>,
    /// True if an earlier plan had other runs.
    pub has_grown: bool,
    /// The lock, held as long as this process works on the batch.
    _lock: File,
}

impl Journal {
    /// Opens or creates the folder for a table. Finished runs in the folder are returned if `resume` is
    /// true, and are an error otherwise.
    pub fn open(
        table: &Path,
        study: &Study,
        resume: bool,
    ) -> Result<(Journal, Found), Box<dyn Problem>> {
        let folder = whole_file::with_suffix(table, ".parts");
        let unwritable = |error| FileError::writing(&folder, error);
        match fs::create_dir(&folder) {
            Err(error) if error.kind() != io::ErrorKind::AlreadyExists => {
                return Err(unwritable(error).into());
            }
            _ => {}
        }
        let names = Names::of(&folder)?;
        if !names.others.iter().all(|name| name == LOCK) {
            return Err(JournalError::Folder(folder).into());
        }
        let lock = File::options().create(true).truncate(false).write(true).open(folder.join(LOCK));
        let lock = lock.map_err(unwritable)?;
        // Some network drives have no locks: there, simultaneous runs are not detected.
        if let Err(TryLockError::WouldBlock) = lock.try_lock() {
            return Err(JournalError::Busy(folder).into());
        }
        if names.has_rows && !resume {
            return Err(JournalError::Unfinished(folder).into());
        }
        // The files of processes that were killed while they wrote them: while this one has the lock,
        // there are no others.
        for name in &names.unfinished {
            let path = folder.join(name);
            fs::remove_file(&path).map_err(|error| FileError::writing(&path, error))?;
        }
        let plan = experiment::plan(study, &folder, chunk(study.runs.count()))?;
        let old = Store::open(Folder(folder.clone())).map_err(StoreProblem)?;
        let has_grown = old.is_some_and(|old| *old.plan() != plan);
        let created = Store::create(Folder(folder.clone()), plan, |run| study.runs.key(run));
        let (store, found) = created.map_err(StoreProblem)?;
        Ok((Journal { folder, store, has_grown, _lock: lock }, found))
    }

    /// Returns the folder, for messages.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Removes the folder, after the table was written.
    pub fn remove(self) -> Result<(), Box<dyn Problem>> {
        // Otherwise, a loss of power could remove the table as well.
        #[cfg(unix)]
        if let Some(beside) = self.folder.parent() {
            let beside = if beside.as_os_str().is_empty() { Path::new(".") } else { beside };
            // Not every file system can flush a folder.
            let _ = File::open(beside).and_then(|folder| folder.sync_all());
        }
        self.store.remove_all().map_err(StoreProblem)?;
        let unwritable = |error| FileError::writing(&self.folder, error);
        fs::remove_file(self.folder.join(LOCK)).map_err(unwritable)?;
        Ok(fs::remove_dir(&self.folder).map_err(unwritable)?)
    }
}
