//! The journal of a batch: finished runs in a folder next to the table, from which an interrupted
//! batch resumes.
//!
//! `FILE.parts` holds
//! * `batch.json`, the key: everything that the rows depend on. A batch with another key cannot
//!   resume here.
//! * `part-N`: a line for each finished run of the Nth part of the batch, with the number of the run, its metrics, and a
//!   sum by which a damaged line is found.
//! * `lock`, which the process that writes holds. The operating system releases it when that
//!   process ends.
//!
//! Key and parts are written to a temporary file, flushed to disk and renamed, so that each of them
//! is always either whole or absent.

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File, TryLockError};
use std::hash::{DefaultHasher, Hasher};
use std::io::{self, Read};
use std::ops::Range;
use std::path::{Path, PathBuf};

use bittybuzz_sources::SOURCES;
use serde_json::{Value, json};

use crate::file_error::FileError;
use crate::problem::Problem;
use crate::whole_file;

use super::arguments::SimArguments;
use super::open::Opened;

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
    /// The journal belongs to another batch.
    #[error("`{folder}` has runs of another batch; not as they were: {}", .changed.join(", "))]
    Differs {
        folder: PathBuf,
        /// Options and files that have changed.
        changed: Vec<String>,
    },
    /// A part of a journal that is damaged.
    #[error("line {line} of `{path}` is damaged, or of another batch")]
    Part {
        path: PathBuf,
        /// The line, from 1.
        line: usize,
    },
}

impl Problem for JournalError {
    fn help(&self) -> Option<String> {
        let help = match self {
            JournalError::Folder(_) => "name another file for the table, or move the folder",
            JournalError::Busy(_) => "wait for it, or name another file for the table",
            JournalError::Unfinished(_) => {
                "--resume goes on with it; to start again, remove the folder"
            }
            JournalError::Differs { .. } => {
                "give the options and files that it was started with; to start again, remove the folder"
            }
            JournalError::Part { .. } => "remove the file: its runs are simulated again",
        };
        Some(help.to_owned())
    }
}

const KEY: &str = "batch.json";
const LOCK: &str = "lock";
const PART: &str = "part-";

/// The most parts of a batch. More parts would lose fewer runs when the process is killed, but take
/// more files.
const PARTS_MAX: usize = 1000;

/// The metrics of a run, in the order of the table's columns.
pub type Metrics = Vec<Option<f64>>;

/// Finished runs, by number.
pub type Finished = BTreeMap<usize, Metrics>;

/// The folder of a batch that is under way.
pub struct Journal {
    folder: PathBuf,
    /// The first line of each part.
    head: String,
    /// The lock, held as long as this process works on the batch.
    _lock: File,
}

/// Returns the numbers of the runs of each part of a batch.
pub fn parts(total: usize) -> Vec<Range<usize>> {
    let size = total.div_ceil(PARTS_MAX).max(1);
    (0..total).step_by(size).map(|first| first..total.min(first + size)).collect()
}

impl Journal {
    /// Opens or creates the folder for a table of `total` rows with `metrics` metrics each.
    /// Finished runs in the folder are returned if `resume` is true, and are an error otherwise.
    pub fn open(
        table: &Path,
        key: &Value,
        [total, metrics]: [usize; 2],
        resume: bool,
    ) -> Result<(Journal, Finished), Box<dyn Problem>> {
        let folder = whole_file::with_suffix(table, ".parts");
        let unwritable = |error| FileError::writing(&folder, error);
        let is_old = match fs::create_dir(&folder) {
            Ok(()) => false,
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => true,
            Err(error) => return Err(unwritable(error).into()),
        };
        let names = names(&folder)?;
        if is_old && !names.iter().all(|name| is_own(name)) {
            return Err(JournalError::Folder(folder).into());
        }
        let lock = File::options().create(true).truncate(false).write(true).open(folder.join(LOCK));
        let lock = lock.map_err(unwritable)?;
        // Some network drives have no locks: there, simultaneous runs are not detected.
        if let Err(TryLockError::WouldBlock) = lock.try_lock() {
            return Err(JournalError::Busy(folder).into());
        }
        let mut hasher = DefaultHasher::new();
        hasher.write(key.to_string().as_bytes());
        let head = format!("bbz batch {:016x}", hasher.finish());
        let journal = Journal { folder, head, _lock: lock };
        let mut numbers = Vec::new();
        for name in &names {
            match name.strip_prefix(PART).map(str::parse::<usize>) {
                Some(Ok(number)) => numbers.push(number),
                _ if name == KEY || name == LOCK => {}
                // The temporary file of a process that was killed while it wrote.
                _ => journal.remove_file(name)?,
            }
        }
        if numbers.is_empty() {
            whole_file::write_in_own_folder(
                &journal.folder.join(KEY),
                format!("{key:#}\n").as_bytes(),
            )?;
            return Ok((journal, Finished::new()));
        }
        if !resume {
            return Err(JournalError::Unfinished(journal.folder).into());
        }
        journal.compare(key)?;
        let parts = parts(total);
        let mut finished = Finished::new();
        for number in numbers {
            // A name of a part that the batch does not have leaves no room for runs, so each of
            // its lines is an error.
            let part = parts.get(number).cloned().unwrap_or_default();
            finished.extend(journal.read(number, &part, metrics)?);
        }
        Ok((journal, finished))
    }

    /// Returns the folder, for messages.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Writes the finished runs of a part. The earlier file remains until the new one is on disk.
    pub fn write(&self, number: usize, finished: &Finished) -> Result<(), FileError> {
        let mut text = self.head.clone() + "\n";
        for (run, metrics) in finished {
            let mut row = run.to_string();
            for metric in metrics {
                row.push(',');
                // The shortest text that is read as the same number.
                row += &metric.map_or(String::new(), |metric| metric.to_string());
            }
            let sum = self.sum(&row);
            text += &format!("{row},{sum}\n");
        }
        whole_file::write_in_own_folder(&self.part(number), text.as_bytes())
    }

    /// Removes the folder, after the table was written.
    pub fn remove(self) -> Result<(), FileError> {
        // Otherwise, a loss of power could remove the table as well.
        #[cfg(unix)]
        if let Some(beside) = self.folder.parent() {
            let beside = if beside.as_os_str().is_empty() { Path::new(".") } else { beside };
            // Not every file system can flush a folder.
            let _ = File::open(beside).and_then(|folder| folder.sync_all());
        }
        let names = names(&self.folder)?;
        // The key is removed after all parts, which have no meaning without it.
        let (last, first): (Vec<&String>, Vec<&String>) = names
            .iter()
            .filter(|name| is_own(name))
            .partition(|name| [KEY, LOCK].contains(&name.as_str()));
        for name in first.into_iter().chain(last) {
            self.remove_file(name)?;
        }
        fs::remove_dir(&self.folder).map_err(|error| FileError::writing(&self.folder, error))
    }

    /// Returns the sum of a row of this batch. As the key, it holds for one program.
    fn sum(&self, row: &str) -> String {
        let mut hasher = DefaultHasher::new();
        hasher.write(self.head.as_bytes());
        hasher.write(row.as_bytes());
        format!("{:016x}", hasher.finish())
    }

    fn part(&self, number: usize) -> PathBuf {
        self.folder.join(format!("{PART}{number}"))
    }

    fn remove_file(&self, name: &str) -> Result<(), FileError> {
        let path = self.folder.join(name);
        fs::remove_file(&path).map_err(|error| FileError::writing(&path, error))
    }

    /// Refuses a folder with another key.
    fn compare(&self, key: &Value) -> Result<(), Box<dyn Problem>> {
        let path = self.folder.join(KEY);
        let bytes = match fs::read(&path) {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == io::ErrorKind::NotFound => Vec::new(),
            Err(error) => return Err(FileError::reading(&path, error).into()),
        };
        // A damaged key differs from every key.
        let old: Value = serde_json::from_slice(&bytes).unwrap_or_default();
        if old == *key {
            return Ok(());
        }
        let folder = self.folder.clone();
        Err(JournalError::Differs { folder, changed: differences(&old, key) }.into())
    }

    fn read(
        &self,
        number: usize,
        part: &Range<usize>,
        metrics: usize,
    ) -> Result<Finished, Box<dyn Problem>> {
        let path = self.part(number);
        let text = fs::read_to_string(&path).map_err(|error| FileError::reading(&path, error))?;
        let mut finished = Finished::new();
        let mut lines = text.split_inclusive('\n').zip(1..);
        let damaged = |line| JournalError::Part { path: path.clone(), line };
        if lines.next().and_then(|(line, _)| line.strip_suffix('\n')) != Some(self.head.as_str()) {
            return Err(damaged(1).into());
        }
        for (line, place) in lines {
            let line = line.strip_suffix('\n').and_then(|line| line.rsplit_once(','));
            let line = line.filter(|(text, sum)| self.sum(text) == *sum);
            let row = line.and_then(|(text, _)| row(text));
            let fits = |(run, row): &(usize, Metrics)| part.contains(run) && row.len() == metrics;
            finished.extend([row.filter(fits).ok_or_else(|| damaged(place))?]);
        }
        Ok(finished)
    }
}

/// Parses a line of a part: the number of the run, and its metrics.
fn row(line: &str) -> Option<(usize, Metrics)> {
    let mut cells = line.split(',');
    let run = cells.next()?.parse().ok()?;
    let metric = |cell: &str| match cell {
        "" => Some(None),
        number => number.parse().ok().map(Some),
    };
    Some((run, cells.map(metric).collect::<Option<Metrics>>()?))
}

/// Returns the names in a folder. A name that is not UTF-8 has replacement characters, so it never
/// equals one of this program's names.
fn names(folder: &Path) -> Result<Vec<String>, FileError> {
    let name = |entry: io::Result<fs::DirEntry>| {
        entry.map(|entry| entry.file_name().to_string_lossy().into_owned())
    };
    let names = fs::read_dir(folder).and_then(|entries| entries.map(name).collect());
    names.map_err(|error| FileError::reading(folder, error))
}

/// Returns true for files of a journal, and for temporary files that were to replace one.
fn is_own(name: &str) -> bool {
    name == LOCK || name.starts_with(KEY) || name.starts_with(PART)
}

/// Returns the key of a batch: everything that its rows depend on.
pub fn key(arguments: &SimArguments, opened: &[&Opened]) -> Result<Value, FileError> {
    let of_file = |path: &Path| {
        let number = File::open(path).and_then(fingerprint);
        let number = number.map_err(|error| FileError::reading(path, error))?;
        Ok::<_, FileError>(format!("{number:016x}"))
    };
    let mut files = BTreeMap::new();
    let mut emulators = BTreeMap::new();
    for variant in opened {
        for path in variant.inputs().paths() {
            if let Entry::Vacant(free) = files.entry(path.display().to_string()) {
                free.insert(of_file(path)?);
            }
        }
        for path in variant.emulator_programs() {
            // A program that is found through PATH has no content here.
            let content = if path.is_file() { of_file(path)? } else { String::new() };
            emulators.insert(path.display().to_string(), content);
        }
    }
    Ok(json!({
        "bbz": format!("{} {SOURCES}", env!("CARGO_PKG_VERSION")),
        "runs": arguments.runs.unwrap_or(1),
        "seed": arguments.seed,
        "set": arguments.set,
        // These make the scenario of a script.
        "robot": arguments.robot,
        "count": arguments.count,
        "emulators": emulators,
        "files": files,
    }))
}

/// Returns a hash of the content. Another release of the standard library may have another one: then
/// programs of the same sources refuse each other's runs.
fn fingerprint(mut content: File) -> io::Result<u64> {
    let mut hasher = DefaultHasher::new();
    let mut buffer = vec![0; 1 << 16];
    loop {
        match content.read(&mut buffer)? {
            0 => return Ok(hasher.finish()),
            count => hasher.write(&buffer[..count]),
        }
    }
}

/// Returns the names of changed options and files, for people.
fn differences(old: &Value, new: &Value) -> Vec<String> {
    let options = ["runs", "seed", "set", "robot", "count"].map(|key| (key, format!("--{key}")));
    let others =
        [("bbz", "the sources of bbz".to_owned()), ("emulators", "the emulator".to_owned())];
    let mut changed_names: Vec<String> = others
        .into_iter()
        .chain(options)
        .filter(|(key, _)| old[*key] != new[*key])
        .map(|(_, name)| name)
        .collect();
    let names = [old, new].into_iter().filter_map(|key| key["files"].as_object());
    let names: BTreeSet<&String> = names.flat_map(|files| files.keys()).collect();
    let changed = names.into_iter().filter(|name| old["files"][*name] != new["files"][*name]);
    changed_names.extend(changed.map(|name| format!("`{name}`")));
    changed_names
}
