//! Carries out the runs of a study, in chunks.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use bittybuzz_arena::output::metrics;
use bittybuzz_arena::run::{self, RunError, RunWatcher, Setup, Simulation, Summary};
use bittybuzz_arena::scenario::ScenarioCause;
use bittybuzz_chunks::{Folder, Outcome, Store};
use bittybuzz_live::Defect;

use crate::chunks::StoreProblem;
use crate::problem::Problem;

use super::data::{BatchData, PartData, RunTables};
use super::live::PATIENCE;
use super::progress::Progress;
use super::study::{Study, StudyPoint};
use super::summary;

/// The time after which the finished runs of an incomplete chunk are written again.
const WRITE_AGAIN: Duration = Duration::from_secs(10);

/// The most points whose faults are kept to be printed.
const FAULTY_MAX: usize = 100;

/// The files that a point reads were changed since the first run.
#[derive(Debug, thiserror::Error)]
#[error("the scenario, a script or a robot file was changed while the runs went on")]
struct Changed;

impl Problem for Changed {
    fn help(&self) -> Option<String> {
        Some("start again: finished runs are of the files as they were".to_owned())
    }
}

/// A reason why a run has no metrics.
#[derive(Debug, thiserror::Error)]
pub enum RunFailure {
    #[error(transparent)]
    Run(#[from] RunError),
    #[error(transparent)]
    Defect(#[from] Defect),
    /// The failure of an earlier attempt.
    #[error("{0}")]
    Before(String),
}

/// The results of a run that has come to its end.
#[derive(Debug)]
pub struct RunResult {
    pub metrics: Vec<Option<f64>>,
    /// The digest of the world at the end.
    pub digest: u64,
}

/// The results of runs, by number.
pub type Ends = BTreeMap<usize, Result<RunResult, RunFailure>>;

/// Simulates a run, and shows it to a watcher. Returns `None` if the batch was interrupted before the end of
/// the run.
pub type Simulate<'a> =
    dyn Fn(&Arc<Setup>, u32, &mut dyn RunWatcher) -> Result<Option<Summary>, RunError> + Sync + 'a;

/// The first run of a point in which a script had an error.
struct Faulty {
    run: usize,
    summary: Summary,
    point: Arc<StudyPoint>,
}

/// The state that the threads share.
pub struct Work<'a> {
    pub study: &'a Study<'a>,
    pub simulate: &'a Simulate<'a>,
    pub store: Option<&'a Store<Folder>>,
    /// The tables of `--data`.
    pub data: Option<&'a BatchData>,
    pub is_interrupted: &'a AtomicBool,
    /// The number of runs to do.
    total: usize,
    /// The number of runs that have ended.
    done: AtomicUsize,
    progress: Mutex<Progress>,
    /// By the number of the point.
    faulty: Mutex<BTreeMap<usize, Faulty>>,
}

/// The reason why a lock is not poisoned.
const UNPOISONED: &str = "a thread only sets values while it holds the lock, and does not panic";

impl<'a> Work<'a> {
    /// Prepares `total` runs.
    pub fn new(
        study: &'a Study<'a>,
        simulate: &'a Simulate<'a>,
        is_interrupted: &'a AtomicBool,
        total: usize,
    ) -> Self {
        let is_hidden = study.arguments.headless || study.arguments.json;
        Work {
            study,
            simulate,
            store: None,
            data: None,
            is_interrupted,
            total,
            done: AtomicUsize::new(0),
            progress: Mutex::new(Progress::new(total as u64, is_hidden)),
            faulty: Mutex::default(),
        }
    }

    /// Removes the line of progress, and prints the faults of scripts: those of one run of each point.
    pub fn finish(self) {
        self.progress.into_inner().expect(UNPOISONED).finish();
        for Faulty { summary, point, .. } in self.faulty.into_inner().expect(UNPOISONED).values() {
            summary::faults(&point.setup, &point.opened.programs, summary);
        }
    }

    /// Carries out the runs of a chunk that are not `known`, and writes the chunk. The result has fewer runs
    /// if the batch was interrupted.
    pub fn chunk(
        &self,
        number: usize,
        runs: Range<usize>,
        known: BTreeMap<usize, Outcome>,
    ) -> Result<Ends, Box<dyn Problem>> {
        let mut data = self.data.map(|data| data.part(number));
        // The rows of finished runs may never have been written.
        let has_data = || self.data.is_none_or(|data| data.has_part(number));
        let mut outcomes = match known.len() == runs.len() && has_data() {
            true => {
                self.done.fetch_add(known.len(), Ordering::Relaxed);
                return Ok(ends(known, Ends::new()));
            }
            false if self.data.is_some() => BTreeMap::new(),
            false => known,
        };
        self.done.fetch_add(outcomes.len(), Ordering::Relaxed);
        let (mut is_written, mut written) = (true, Instant::now());
        let write = |outcomes: &BTreeMap<usize, Outcome>| -> Result<(), Box<dyn Problem>> {
            let key = |run| self.study.runs.key(run);
            Ok(self
                .store
                .map_or(Ok(()), |store| store.write(number, outcomes, key))
                .map_err(StoreProblem)?)
        };
        let mut failed = Ends::new();
        let mut current: Option<(usize, Arc<StudyPoint>)> = None;
        let mut is_whole = true;
        for run in runs {
            if outcomes.contains_key(&run) {
                continue;
            }
            let place = self.study.runs.point_of(run);
            let point = match current.take() {
                Some((known, point)) if known == place => point,
                _ => self.open(place)?,
            };
            current = Some((place, point.clone()));
            match self.complete(run, &point, data.as_mut()) {
                Ok(None) => {
                    is_whole = false;
                    break;
                }
                Ok(Some(RunResult { metrics, digest })) => {
                    outcomes.insert(run, Outcome::Complete { metrics, digest });
                    is_written = false;
                }
                // The terminal sends Ctrl-C to emulators, too, and an emulator may end first.
                Err(error) if is_emulators(&error) && self.is_interrupted_within(PATIENCE) => {
                    is_whole = false;
                    break;
                }
                Err(error) => {
                    if let Some(data) = &mut data {
                        let values = &self.study.runs.plan.points[place];
                        let (name, scenario) = (run as u32, &point.opened.scenario);
                        data.add_failure(
                            (name, self.study.runs.seed(run)),
                            values,
                            scenario,
                            &error.to_string(),
                        );
                    }
                    outcomes.insert(run, Outcome::Failed(error.to_string()));
                    failed.insert(run, Err(error));
                    is_written = false;
                }
            }
            let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
            let mut progress = self.progress.lock().expect(UNPOISONED);
            progress.set(done as u64, |_| format!("{done} of {} runs", self.total));
            drop(progress);
            if !is_written && written.elapsed() >= WRITE_AGAIN {
                write(&outcomes)?;
                (is_written, written) = (true, Instant::now());
            }
        }
        // Runs count as finished when all that they give is on disk.
        if let (Some(data), true) = (data, is_whole) {
            data.write()?;
        }
        if !is_written {
            write(&outcomes)?;
        }
        Ok(ends(outcomes, failed))
    }

    fn open(&self, point: usize) -> Result<Arc<StudyPoint>, Box<dyn Problem>> {
        if point == 0 {
            return Ok(self.study.first.clone());
        }
        match self.study.point(point) {
            Ok(point) => Ok(Arc::new(point)),
            // All points were opened before the first run.
            Err(unopened) => {
                unopened.print()?;
                Err(Changed.into())
            }
        }
    }

    /// Simulates a run. Returns `None` if the batch was interrupted before the end of the run. A
    /// defect ends this run alone; nothing but its own state has changed.
    fn complete(
        &self,
        run: usize,
        point: &Arc<StudyPoint>,
        data: Option<&mut PartData<'_>>,
    ) -> Result<Option<RunResult>, RunFailure> {
        let seed = self.study.runs.seed(run);
        let mut tables = data.is_some().then(|| RunTables::new(run as u32, &point.setup));
        let mut digest = None;
        let mut last = |simulation: &Simulation| {
            if simulation.is_over() {
                digest = Some(simulation.digest());
            }
        };
        let summary = Defect::catch(|| match &mut tables {
            Some(tables) => (self.simulate)(&point.setup, seed, tables),
            None => (self.simulate)(&point.setup, seed, &mut last),
        })??;
        let Some(summary) = summary else { return Ok(None) };
        let scenario = &point.opened.scenario;
        let metrics = metrics::values(scenario, &summary);
        let digest = tables.as_ref().map_or(digest, RunTables::digest);
        let digest = digest.expect("a watcher sees the end of the run");
        let place = self.study.runs.point_of(run);
        if let (Some(data), Some(tables)) = (data, tables) {
            data.add(tables, &self.study.runs.plan.points[place], scenario, &summary);
        }
        if !summary.faults.is_empty() {
            let mut faulty = self.faulty.lock().expect(UNPOISONED);
            if faulty.get(&place).is_none_or(|first| run < first.run) {
                faulty.insert(place, Faulty { run, summary, point: point.clone() });
            }
            if faulty.len() > FAULTY_MAX {
                faulty.pop_last();
            }
        }
        Ok(Some(RunResult { metrics, digest }))
    }

    fn is_interrupted_within(&self, time: Duration) -> bool {
        let start = Instant::now();
        loop {
            let is_interrupted = self.is_interrupted.load(Ordering::Relaxed);
            if is_interrupted || start.elapsed() >= time {
                return is_interrupted;
            }
            thread::sleep(Duration::from_millis(5));
        }
    }
}

/// Returns the results of rows; `failed` has the failures of this process.
pub fn ends(outcomes: BTreeMap<usize, Outcome>, mut failed: Ends) -> Ends {
    let end = |(run, outcome)| {
        let end = match outcome {
            Outcome::Complete { metrics, digest } => Ok(RunResult { metrics, digest }),
            Outcome::Failed(reason) => {
                failed.remove(&run).unwrap_or(Err(RunFailure::Before(reason)))
            }
        };
        (run, end)
    };
    outcomes.into_iter().map(end).collect()
}

/// Returns true for failures of an emulator, which Ctrl-C causes as well.
fn is_emulators(error: &RunFailure) -> bool {
    match error {
        RunFailure::Run(RunError::Firmware(_)) => true,
        RunFailure::Run(RunError::Scenario(error)) => {
            matches!(error.cause, ScenarioCause::Emulator { .. })
        }
        RunFailure::Defect(_) | RunFailure::Before(_) => false,
    }
}

/// Simulates a run to its end, unless the flag is set before.
pub fn complete(
    setup: &Arc<Setup>,
    seed: u32,
    watcher: &mut dyn RunWatcher,
    is_interrupted: &AtomicBool,
) -> Result<Option<Summary>, RunError> {
    run::complete_watched(setup, seed, || is_interrupted.load(Ordering::Relaxed), watcher)
}
