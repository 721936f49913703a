//! The folder of a sweep.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::hash::{BuildHasher, RandomState};
use std::io;
use std::ops::Range;
use std::path::PathBuf;

use crate::disk::Disk;
use crate::file::{self, FileFault, Head};
use crate::plan::Plan;
use crate::row::{Outcome, Row, RunKey};

/// The name of the file of the plan.
pub const PLAN: &str = "plan.json";

/// The end of the name of a file with all rows of a chunk.
const WHOLE: &str = ".runs";

/// The end of the name of a file with some rows of a chunk.
const PARTIAL: &str = ".known";

/// The end of the name of a file that was damaged.
const ASIDE: &str = ".damaged";

/// The middle of the name of a file that is being written.
const UNFINISHED: &str = ".unfinished-";

/// A reason why a folder cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    #[error("cannot read `{0}`: {1}")]
    Read(PathBuf, io::Error),
    #[error("cannot write `{0}`: {1}")]
    Write(PathBuf, io::Error),
    #[error("`{path}` is no plan: {reason}")]
    NoPlan { path: PathBuf, reason: String },
    /// A file that this program cannot read although its checksum is right.
    #[error("`{0}` was written by another version of bbz")]
    Foreign(PathBuf),
    /// Rows that programs of other sources have simulated.
    #[error("`{path}` is of bbz {of}, and this plan of bbz {own}")]
    MixedPrograms { path: PathBuf, of: String, own: String },
    /// A plan for a program of other sources than this one.
    #[error("`{path}` is of bbz {of}, and this is bbz {own}")]
    OtherProgram { path: PathBuf, of: String, own: String },
    /// Rows of another scenario, or of other scripts.
    #[error("`{path}` is of another experiment; not as they were: {}", .changed.join(", "))]
    OtherExperiment { path: PathBuf, changed: Vec<String> },
    /// Two results of one run.
    #[error("`{one}` and `{other}` have different results of one run: {run}")]
    Contradiction { one: PathBuf, other: PathBuf, run: RunKey },
}

/// A damaged file that was moved aside.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Aside {
    pub path: PathBuf,
    /// Its path now.
    pub now: PathBuf,
}

/// Rows that were found in a folder.
#[derive(Debug, Default)]
pub struct Found {
    /// By the number of the run in the plan.
    pub outcomes: BTreeMap<usize, Outcome>,
    pub aside: Vec<Aside>,
}

/// The folder of a sweep, with its plan.
pub struct Store<D> {
    disk: D,
    plan: Plan,
    /// The name of the plan.
    id: String,
}

/// The numbers of the runs in the plan, by their keys. A plan may have a point twice.
type Numbers = HashMap<RunKey, Vec<usize>>;

/// Returns the numbers of runs by their keys.
fn numbers(runs: Range<usize>, key: impl Fn(usize) -> RunKey) -> Numbers {
    let mut numbers = Numbers::new();
    for run in runs {
        numbers.entry(key(run)).or_default().push(run);
    }
    numbers
}

impl<D: Disk> Store<D> {
    /// Opens a folder, or returns `None` if it has no plan.
    pub fn open(disk: D) -> Result<Option<Self>, StoreError> {
        let path = disk.path(PLAN);
        let bytes = match disk.read(PLAN) {
            Ok(Some(bytes)) => bytes,
            Ok(None) => return Ok(None),
            Err(error) => return Err(StoreError::Read(path, error)),
        };
        let plan = Plan::parse(&bytes).map_err(|reason| StoreError::NoPlan { path, reason })?;
        Ok(Some(Store { disk, id: plan.id(), plan }))
    }

    /// Gives a folder a plan. An earlier plan must be of the same experiment; its rows are kept.
    /// Returns the rows of the new plan that are finished. `key` returns the key of a run.
    pub fn create(
        disk: D,
        plan: Plan,
        key: impl Fn(usize) -> RunKey,
    ) -> Result<(Self, Found), StoreError>
    where
        D: Clone,
    {
        let old = Store::open(disk.clone())?;
        let store = Store { disk, id: plan.id(), plan };
        if let Some(old) = old {
            let Plan { experiment, files, .. } = old.plan;
            store.compare(PLAN, &Head { experiment, files })?;
        }
        let numbers = numbers(0..store.plan.runs(), &key);
        let (found, sources) = store.gather(&numbers)?;
        if sources.keys().any(|name| store.is_other(name)) {
            for chunk in 0..store.plan.chunks() {
                let known = found.outcomes.range(store.plan.runs_of(chunk));
                let known: BTreeMap<usize, Outcome> =
                    known.map(|(run, outcome)| (*run, outcome.clone())).collect();
                if !known.is_empty() {
                    store.write(chunk, &known, &key)?;
                }
            }
        }
        store.write_file(PLAN, store.plan.to_text().as_bytes())?;
        // From here on, the new files have these rows. A file with other rows stays for a later plan.
        for (name, has_others) in &sources {
            if store.is_other(name) && !has_others {
                store.remove(name)?;
            }
        }
        Ok((store, found))
    }

    /// Returns the plan.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Returns the path of the plan, for messages.
    pub fn path(&self) -> PathBuf {
        self.disk.path(PLAN)
    }

    /// Returns the rows of a chunk that are finished. A damaged file of the chunk is moved aside.
    pub fn chunk(&self, chunk: usize, key: impl Fn(usize) -> RunKey) -> Result<Found, StoreError> {
        let runs = self.plan.runs_of(chunk);
        let numbers = numbers(runs.clone(), key);
        let mut found = Found::default();
        let mut places = BTreeMap::new();
        for kind in [WHOLE, PARTIAL] {
            self.add(&self.name(chunk, kind), &numbers, &mut found, &mut places)?;
            if found.outcomes.len() == runs.len() {
                return Ok(found);
            }
        }
        // Rows of another plan, which another process may have written after this plan was made.
        for other in self.row_files()?.into_iter().filter(|name| self.is_other(name)) {
            self.add(&other, &numbers, &mut found, &mut places)?;
        }
        Ok(found)
    }

    /// Returns true if there is a file with all rows of a chunk, which may be damaged.
    pub fn has_chunk(&self, chunk: usize) -> Result<bool, StoreError> {
        Ok(self.names()?.contains(&self.name(chunk, WHOLE)))
    }

    /// Returns all rows of the plan that are finished. Damaged files are moved aside.
    pub fn all(&self, key: impl Fn(usize) -> RunKey) -> Result<Found, StoreError> {
        Ok(self.gather(&numbers(0..self.plan.runs(), key))?.0)
    }

    /// Writes the rows of a chunk that are finished. When it returns, they survive a loss of power.
    pub fn write(
        &self,
        chunk: usize,
        outcomes: &BTreeMap<usize, Outcome>,
        key: impl Fn(usize) -> RunKey,
    ) -> Result<(), StoreError> {
        let row =
            |(run, outcome): (&usize, &Outcome)| Row { key: key(*run), outcome: outcome.clone() };
        let rows: Vec<Row> = outcomes.iter().map(row).collect();
        let Plan { experiment, files, .. } = &self.plan;
        let head = Head { experiment: experiment.clone(), files: files.clone() };
        let bytes = file::to_bytes(&head, &rows);
        let partial = self.name(chunk, PARTIAL);
        if outcomes.len() < self.plan.runs_of(chunk).len() {
            return self.write_file(&partial, &bytes);
        }
        self.write_file(&self.name(chunk, WHOLE), &bytes)?;
        self.remove(&partial)
    }

    /// Removes all files of the store.
    pub fn remove_all(&self) -> Result<(), StoreError> {
        let mut names = self.names()?;
        names.retain(|name| file_kind(name).is_some());
        // The plan is removed after the rows, which have no meaning without it.
        names.sort_by_key(|name| name == PLAN);
        names.iter().try_for_each(|name| self.remove(name))
    }

    /// Returns the rows of the plan in all files, and for each file that has some true if it has
    /// other rows, too.
    fn gather(&self, numbers: &Numbers) -> Result<(Found, BTreeMap<String, bool>), StoreError> {
        let mut found = Found::default();
        let (mut places, mut sources) = (BTreeMap::new(), BTreeMap::new());
        for name in self.row_files()? {
            if let Some(has_others) = self.add(&name, numbers, &mut found, &mut places)? {
                sources.insert(name, has_others);
            }
        }
        Ok((found, sources))
    }

    /// Adds the rows of a file that are in `numbers`. Returns true if the file has other rows, too, and
    /// `None` if there is no such file or if it is damaged.
    fn add(
        &self,
        name: &str,
        numbers: &Numbers,
        found: &mut Found,
        places: &mut BTreeMap<usize, String>,
    ) -> Result<Option<bool>, StoreError> {
        let Some(bytes) = self.read(name)? else { return Ok(None) };
        let (head, rows) = match file::parse(&bytes) {
            Ok(content) => content,
            Err(FileFault::Foreign) => return Err(StoreError::Foreign(self.disk.path(name))),
            Err(FileFault::Damaged) => {
                found.aside.push(self.set_aside(name)?);
                return Ok(None);
            }
        };
        self.compare(name, &head)?;
        let mut has_others = false;
        for Row { key, outcome } in rows {
            let runs = numbers.get(&key).map_or(&[][..], Vec::as_slice);
            let Some(run) = runs.first() else {
                has_others = true;
                continue;
            };
            let is_new = match found.outcomes.get(run) {
                None => true,
                Some(known) if known.is_same(&outcome) => false,
                // A later attempt succeeded.
                Some(Outcome::Failed(_)) if matches!(outcome, Outcome::Complete { .. }) => true,
                Some(Outcome::Complete { .. }) if matches!(outcome, Outcome::Failed(_)) => false,
                // The order of the files must not decide.
                Some(Outcome::Failed(reason)) => {
                    matches!(&outcome, Outcome::Failed(other) if other < reason)
                }
                Some(_) => {
                    let [one, other] = [&places[run], name].map(|name| self.disk.path(name));
                    return Err(StoreError::Contradiction { one, other, run: key });
                }
            };
            if is_new {
                found.outcomes.extend(runs.iter().map(|run| (*run, outcome.clone())));
                places.insert(*run, name.to_owned());
            }
        }
        Ok(Some(has_others))
    }

    /// Refuses a file of another experiment.
    fn compare(&self, name: &str, head: &Head) -> Result<(), StoreError> {
        let path = self.disk.path(name);
        let (of, own) = (&head.experiment.program, &self.plan.experiment.program);
        if of != own {
            let [of, own] = [of, own].map(Clone::clone);
            return Err(StoreError::MixedPrograms { path, of, own });
        }
        let mut changed = head.experiment.differences(&self.plan.experiment);
        let common =
            head.files.iter().filter_map(|(name, of)| Some((name, of, self.plan.files.get(name)?)));
        changed
            .extend(common.filter(|(_, of, own)| of != own).map(|(name, ..)| format!("`{name}`")));
        if !changed.is_empty() {
            return Err(StoreError::OtherExperiment { path, changed });
        }
        Ok(())
    }

    /// Moves a damaged file aside.
    fn set_aside(&self, name: &str) -> Result<Aside, StoreError> {
        let aside = format!("{name}{ASIDE}-{}", random());
        self.disk.rename(name, &aside).map_err(|error| self.unwritable(name, error))?;
        Ok(Aside { path: self.disk.path(name), now: self.disk.path(&aside) })
    }

    /// Writes a file whole or not at all. When it returns, the file survives a loss of power.
    fn write_file(&self, name: &str, bytes: &[u8]) -> Result<(), StoreError> {
        // Other processes, on other computers, too, may write the same file.
        let aside = format!("{name}{UNFINISHED}{}", random());
        let written = self
            .disk
            .create(&aside, bytes)
            .and_then(|()| self.disk.sync(&aside))
            .and_then(|()| self.disk.rename(&aside, name))
            .and_then(|()| self.disk.sync_folder());
        written.map_err(|error| {
            // The disk may be full; the first error is the one to report.
            let _ = self.disk.remove(&aside);
            self.unwritable(name, error)
        })
    }

    fn read(&self, name: &str) -> Result<Option<Vec<u8>>, StoreError> {
        self.disk.read(name).map_err(|error| StoreError::Read(self.disk.path(name), error))
    }

    fn names(&self) -> Result<Vec<String>, StoreError> {
        let mut names =
            self.disk.names().map_err(|error| StoreError::Read(self.disk.path(""), error))?;
        names.sort_unstable();
        Ok(names)
    }

    /// Returns the names of all files with rows.
    fn row_files(&self) -> Result<BTreeSet<String>, StoreError> {
        Ok(self.names()?.into_iter().filter(|name| is_row_file(name)).collect())
    }

    fn remove(&self, name: &str) -> Result<(), StoreError> {
        self.disk.remove(name).map_err(|error| self.unwritable(name, error))
    }

    /// Returns the name of a file of a chunk.
    fn name(&self, chunk: usize, end: &str) -> String {
        format!("{}-{chunk:06}{end}", self.id)
    }

    /// Returns true for a file with rows of another plan.
    fn is_other(&self, name: &str) -> bool {
        !name.starts_with(&self.id)
    }

    fn unwritable(&self, name: &str, error: io::Error) -> StoreError {
        StoreError::Write(self.disk.path(name), error)
    }
}

/// Returns true for the names of files with rows.
fn is_row_file(name: &str) -> bool {
    let stem = [WHOLE, PARTIAL].iter().find_map(|end| name.strip_suffix(end));
    stem.and_then(|stem| stem.split_once('-')).is_some_and(|(id, number)| {
        id.len() == 16
            && id.bytes().all(|byte| byte.is_ascii_hexdigit())
            && number.bytes().all(|byte| byte.is_ascii_digit())
    })
}

/// A kind of file in the folder of a sweep.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FileKind {
    Plan,
    /// Rows of a chunk: all, or some.
    Rows,
    /// A file that a process is writing, or that a killed process has left.
    Unfinished,
    /// A damaged file that was set aside.
    Damaged,
}

/// Returns the kind of a file by its name, or `None` if it is no sweep's.
pub fn file_kind(name: &str) -> Option<FileKind> {
    let (whole, kind) = match (name.split_once(UNFINISHED), name.split_once(ASIDE)) {
        (Some((whole, _)), _) => (whole, Some(FileKind::Unfinished)),
        (_, Some((whole, _))) => (whole, Some(FileKind::Damaged)),
        _ => (name, None),
    };
    let own = match whole {
        PLAN => Some(FileKind::Plan),
        rows => is_row_file(rows).then_some(FileKind::Rows),
    };
    own.map(|own| kind.unwrap_or(own))
}

/// Returns a number that no other process has, in hexadecimal.
fn random() -> String {
    format!("{:016x}", RandomState::new().hash_one(std::process::id()))
}
