//! Simulates many runs: every point of a plan, with every seed.

use std::collections::BTreeMap;
use std::iter;
use std::mem;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use annotate_snippets::{Group, Level};
use bittybuzz_arena::output::{RunRow, RunTable, metrics};
use bittybuzz_arena::run::{self, RunError, Setup, Summary};
use bittybuzz_arena::scenario::{Scenario, ScenarioCause};
use bittybuzz_arena::sweep::{Axis, Chance, ParameterValue, Plan};
use bittybuzz_live::Defect;
use rayon::prelude::*;

use crate::escape::escaped;
use crate::exit::ExitStatus;
use crate::file_error::FileError;
use crate::interrupt::Interrupt;
use crate::output;
use crate::problem::Problem;
use crate::report;
use crate::whole_file;

use super::arguments::SimArguments;
use super::data::{self, BatchData, PartData, RunTables};
use super::journal::{self, Finished, Journal, Metrics};
use super::live::PATIENCE;
use super::open::{self, Opened};
use super::plan;
use super::progress::Progress;
use super::stops::{print_failures, print_interrupt};
use super::{doors, summary, table};

/// A reason why the runs cannot be a batch.
#[derive(Debug, thiserror::Error)]
enum BatchError {
    /// Values of `--set` that change the columns of the table.
    #[error("the values of `--set` change which columns the table has")]
    DifferentColumns,
    /// Values of `--set` that change the columns of the tables of `--data`.
    #[error("the values of `--set` change which columns the tables of --data have")]
    DifferentData,
    /// Robots with doors, which are at the same ports in each run.
    #[error("robots with a `door` for ground stations run once, not in a batch")]
    Doors,
    /// The system gives no threads.
    #[error("cannot start threads: {0}")]
    Threads(String),
    /// `--resume` with a table that goes to a stream.
    #[error("`{0}` is no file, so there is no batch to resume")]
    NothingToResume(PathBuf),
}

impl Problem for BatchError {
    fn help(&self) -> Option<String> {
        let help = match self {
            BatchError::DifferentColumns | BatchError::DifferentData => {
                "use `bbz sim` once for each, with a table of its own"
            }
            BatchError::Doors => "leave out `door`, or --runs, --csv and further values of --set",
            BatchError::Threads(_) => "ask for fewer with --threads",
            BatchError::NothingToResume(_) => {
                "name a file, next to which finished runs can be kept"
            }
        };
        Some(help.to_owned())
    }
}

/// The time after which the finished runs of an incomplete part are written again.
const WRITE_AGAIN: Duration = Duration::from_secs(10);

/// A point of the plan.
pub struct Variant<'a> {
    point: &'a [ParameterValue],
    /// The values of the point as settings of the scenario.
    pub settings: Vec<String>,
    /// The values of the point as cells of the table.
    cells: Arc<[String]>,
    opened: Opened,
    setup: Arc<Setup>,
    /// The first run of this process in which a script had an error, with the number of the run.
    faulty: Mutex<Option<(usize, Summary)>>,
}

/// A run of the batch.
pub struct BatchRun<'a> {
    pub variant: &'a Variant<'a>,
    pub seed: u32,
}

/// A reason why a run has no metrics.
#[derive(Debug, thiserror::Error)]
pub enum RunFailure {
    #[error(transparent)]
    Run(#[from] RunError),
    #[error(transparent)]
    Defect(#[from] Defect),
}

/// The results of runs, by number.
pub type Ends = BTreeMap<usize, Result<Metrics, RunFailure>>;

/// Runs every variant with every seed, and prints the usual results.
pub fn run(arguments: &SimArguments, axes: Vec<Axis>) -> Result<ExitStatus, Box<dyn Problem>> {
    let Some((plan, places)) = plan::plan(arguments, axes)? else {
        return Ok(ExitStatus::CompileError);
    };
    let mut variants = Vec::new();
    for point in &plan.points {
        let settings = plan.settings(point);
        let Some(opened) = open::open(arguments, &settings, &places)? else {
            return Ok(ExitStatus::CompileError);
        };
        let Some(setup) = opened.setup() else { return Ok(ExitStatus::CompileError) };
        let cells = point.iter().map(ToString::to_string).collect();
        let setup = Arc::new(setup);
        let faulty = Mutex::default();
        variants.push(Variant { point, settings, cells, opened, setup, faulty });
    }
    let first = variants.first().expect("there is one point even of no parameters");
    let columns = metrics::metrics(&first.opened.scenario);
    if variants.iter().any(|variant| metrics::metrics(&variant.opened.scenario) != columns) {
        return Err(BatchError::DifferentColumns.into());
    }
    if variants.iter().any(|variant| doors::exist(&variant.opened.scenario)) {
        return Err(BatchError::Doors.into());
    }
    let shared = &plan;
    let runs = variants.iter().flat_map(|variant| {
        // A point may set the seed.
        let first = arguments.seed.unwrap_or(variant.opened.scenario.world.seed);
        let seed = move |replicate| shared.seed(variant.point, replicate, first);
        (0..shared.replicates).map(move |replicate| BatchRun { variant, seed: seed(replicate) })
    });
    let runs: Vec<BatchRun> = runs.collect();
    let data = match &arguments.data {
        None => None,
        Some(path) => {
            let scenario = &first.opened.scenario;
            let quantities = data::quantities(scenario);
            let is_other = |other: &Scenario| {
                let (data, of_first) = (&other.output.data, &scenario.output.data);
                data::quantities(other) != quantities || data.messages != of_first.messages
            };
            if variants.iter().any(|variant| is_other(&variant.opened.scenario)) {
                return Err(BatchError::DifferentData.into());
            }
            Some(BatchData::create(path, &plan, scenario, arguments.resume)?)
        }
    };
    let interrupt = Interrupt::install()?;
    let (journal, finished) = journal(arguments, &variants, [runs.len(), columns.len()])?;
    if !finished.is_empty() {
        let title = format!("{} of {} runs were finished before", finished.len(), runs.len());
        report::print(Group::with_title(Level::NOTE.primary_title(title)));
    }
    let is_interrupted = interrupt.flag();
    let batch = Batch {
        runs: &runs,
        simulate: &|run: &BatchRun, tables| {
            let is_interrupted = || is_interrupted.load(Ordering::Relaxed);
            let (setup, seed) = (&run.variant.setup, run.seed);
            match tables {
                Some(tables) => run::complete_watched(setup, seed, is_interrupted, tables),
                None => run::complete(setup, seed, is_interrupted),
            }
        },
        journal: journal.as_ref(),
        data: data.as_ref(),
        is_interrupted: &is_interrupted,
        done: AtomicUsize::new(finished.len()),
        progress: Mutex::new(Progress::new(
            runs.len() as u64,
            arguments.headless || arguments.json,
        )),
    };
    let ends = match arguments.threads {
        None => batch.simulate(finished),
        Some(threads) => {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            let pool = pool.map_err(|error| BatchError::Threads(error.to_string()))?;
            pool.install(|| batch.simulate(finished))
        }
    };
    let ends = ends?;
    batch.progress.into_inner().expect(UNPOISONED).finish();
    print_failures(arguments, &runs, &ends);
    let is_complete = ends.len() == runs.len();
    let is_worldless =
        |end: &Result<_, RunFailure>| matches!(end, Err(RunFailure::Run(RunError::Scenario(_))));
    if is_complete && ends.values().all(is_worldless) {
        journal.map_or(Ok(()), Journal::remove)?;
        return Ok(ExitStatus::CompileError);
    }
    let kept = ends.values().filter(|end| end.is_ok()).count();
    let (numbers, rows): (Vec<usize>, Vec<RunRow>) = ends
        .into_iter()
        .map(|(number, end)| (number, row(&runs[number], end, columns.len())))
        .unzip();
    let keys = plan.parameters.iter().map(|parameter| parameter.name.clone()).collect();
    let names = columns.iter().map(|column| column.name.clone()).collect();
    let table = RunTable { parameters: keys, rows, metrics: names };
    let folder = journal.as_ref().map(|journal| journal.folder().to_owned());
    if let (Some(path), true) = (&arguments.csv, is_complete) {
        whole_file::write(path, escaped(&table.to_csv()).as_bytes())?;
    }
    if is_complete || kept == 0 {
        journal.map_or(Ok(()), Journal::remove)?;
    }
    let mut text = String::new();
    if arguments.json {
        text = table::json(&table).to_string() + "\n";
    } else {
        if first.opened.scenario.sweep.is_some() {
            text += &describe(&plan);
        }
        for (index, variant) in variants.iter().enumerate() {
            if let Some((_, run)) = &*variant.faulty.lock().expect(UNPOISONED) {
                summary::faults(&variant.setup, &variant.opened.programs, run);
            }
            // The runs of a point have successive numbers, and an interrupted batch lacks some.
            let [from, to] = [index, index + 1].map(|index| {
                let number = index * plan.replicates as usize;
                numbers.partition_point(|known| *known < number)
            });
            let rows: Vec<&RunRow> = table.rows[from..to].iter().collect();
            let duration = variant.opened.scenario.world.duration;
            table::describe(&columns, &rows, &variant.name(&plan), duration, &mut text);
        }
    }
    output::write(&text)?;
    if !is_complete {
        print_interrupt([kept, runs.len()], folder.as_deref());
        return Ok(ExitStatus::Interrupted);
    }
    // A failed expectation is a result of the runs, and counted there. An engine that schedules many
    // batches would take another status as a reason to repeat this one.
    let have_ended = table.rows.iter().all(|row| row.error.is_none());
    Ok(if have_ended { ExitStatus::Success } else { ExitStatus::RuntimeError })
}

impl Variant<'_> {
    /// Returns the values of the point with the names of the parameters.
    fn name(&self, plan: &Plan) -> String {
        let parts = plan.parameters.iter().zip(&*self.cells);
        let parts = parts.map(|(parameter, cell)| format!("{}={cell}", parameter.name));
        parts.collect::<Vec<String>>().join(" ")
    }
}

/// Describes the points of a study, and their chance.
fn describe(plan: &Plan) -> String {
    let (points, runs) = (plan.points.len(), plan.replicates);
    let chance = match plan.chance {
        Chance::Common => "all points have the same seeds (common random numbers)",
        Chance::Independent => "each point has seeds of its own (independent)",
    };
    format!("[sweep]: {points} points, {runs} runs of each; {chance}\n")
}

/// Opens the journal of the table of `--csv`. A stream has none, because nothing stays in it.
fn journal(
    arguments: &SimArguments,
    variants: &[Variant],
    sizes: [usize; 2],
) -> Result<(Option<Journal>, Finished), Box<dyn Problem>> {
    let Some(path) = &arguments.csv else { return Ok((None, Finished::new())) };
    variants.iter().try_for_each(|variant| variant.opened.inputs().refuse(path))?;
    if path.is_dir() {
        return Err(FileError::writing(path, std::io::ErrorKind::IsADirectory.into()).into());
    }
    if whole_file::is_stream(path) {
        return match arguments.resume {
            true => Err(BatchError::NothingToResume(path.clone()).into()),
            false => Ok((None, Finished::new())),
        };
    }
    let opened: Vec<&Opened> = variants.iter().map(|variant| &variant.opened).collect();
    let key = journal::key(arguments, &opened)?;
    let (journal, finished) = Journal::open(path, &key, sizes, arguments.resume)?;
    Ok((Some(journal), finished))
}

/// The reason why a lock of a batch is not poisoned.
const UNPOISONED: &str = "a thread only sets values while it holds the lock, and does not panic";

/// Simulates a run, and fills its tables. Returns `None` if the batch was interrupted before the end of
/// the run.
type Simulate<'a> =
    dyn Fn(&BatchRun, Option<&mut RunTables>) -> Result<Option<Summary>, RunError> + Sync + 'a;

/// The state that the threads of a batch share.
struct Batch<'a> {
    runs: &'a [BatchRun<'a>],
    simulate: &'a Simulate<'a>,
    journal: Option<&'a Journal>,
    /// The tables of `--data`.
    data: Option<&'a BatchData>,
    is_interrupted: &'a AtomicBool,
    /// The number of runs that have ended.
    done: AtomicUsize,
    progress: Mutex<Progress>,
}

impl Batch<'_> {
    /// Simulates the runs that are not finished yet, until all are or the batch is interrupted.
    fn simulate(&self, mut finished: Finished) -> Result<Ends, FileError> {
        let parts = journal::parts(self.runs.len()).into_iter().enumerate();
        let parts: Vec<(usize, Range<usize>, Finished)> = parts
            .map(|(number, part)| {
                let later = finished.split_off(&part.end);
                (number, part, mem::replace(&mut finished, later))
            })
            .collect();
        let ends: Result<Vec<Ends>, FileError> = parts
            .into_par_iter()
            .map(|(number, part, finished)| self.part(number, part, finished))
            .collect();
        Ok(ends?.into_iter().flatten().collect())
    }

    /// Simulates the runs of a part that are not finished yet, and writes the part.
    fn part(
        &self,
        number: usize,
        part: Range<usize>,
        mut finished: Finished,
    ) -> Result<Ends, FileError> {
        let mut failed = Ends::new();
        let (mut is_written, mut written) = (true, Instant::now());
        let write = |finished: &Finished| match self.journal {
            Some(journal) => journal.write(number, finished),
            None => Ok(()),
        };
        let mut data = self.data.map(|data| data.part(number));
        if let Some(data) = self.data {
            let is_finished = part.clone().all(|run| finished.contains_key(&run));
            match is_finished && data.has_part(number) {
                true => return Ok(finished.into_iter().map(|(run, end)| (run, Ok(end))).collect()),
                false => {
                    // The rows of finished runs were never written.
                    self.done.fetch_sub(finished.len(), Ordering::Relaxed);
                    finished.clear();
                }
            }
        }
        let mut is_whole = true;
        for run in part {
            if finished.contains_key(&run) {
                continue;
            }
            match self.complete(run, data.as_mut()) {
                Ok(None) => {
                    is_whole = false;
                    break;
                }
                Ok(Some(metrics)) => {
                    finished.insert(run, metrics);
                    is_written = false;
                }
                // The terminal sends Ctrl-C to emulators, too, and an emulator may end first.
                Err(error) if is_emulators(&error) && self.is_interrupted_within(PATIENCE) => {
                    is_whole = false;
                    break;
                }
                Err(error) => {
                    if let Some(data) = &mut data {
                        let BatchRun { variant, seed } = &self.runs[run];
                        let scenario = &variant.opened.scenario;
                        data.add_failure(
                            (run as u32, *seed),
                            variant.point,
                            scenario,
                            &error.to_string(),
                        );
                    }
                    failed.insert(run, Err(error));
                }
            }
            let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
            let mut progress = self.progress.lock().expect(UNPOISONED);
            progress.set(done as u64, |_| format!("{done} of {} runs", self.runs.len()));
            drop(progress);
            if !is_written && written.elapsed() >= WRITE_AGAIN {
                write(&finished)?;
                (is_written, written) = (true, Instant::now());
            }
        }
        // Runs count as finished when all that they give is on disk.
        if let (Some(data), true) = (data, is_whole) {
            data.write()?;
        }
        if !is_written {
            write(&finished)?;
        }
        failed.extend(finished.into_iter().map(|(run, metrics)| (run, Ok(metrics))));
        Ok(failed)
    }

    /// Simulates a run. Returns `None` if the batch was interrupted before the end of the run. A
    /// defect ends this run alone; nothing but its own state has changed.
    fn complete(
        &self,
        number: usize,
        data: Option<&mut PartData<'_>>,
    ) -> Result<Option<Metrics>, RunFailure> {
        let run = &self.runs[number];
        let mut tables = data.is_some().then(|| RunTables::new(number as u32, &run.variant.setup));
        let summary = Defect::catch(|| (self.simulate)(run, tables.as_mut()))??;
        let Some(summary) = summary else { return Ok(None) };
        let scenario = &run.variant.opened.scenario;
        let metrics = metrics::values(scenario, &summary);
        if let (Some(data), Some(tables)) = (data, tables) {
            data.add(tables, run.variant.point, scenario, &summary);
        }
        if !summary.faults.is_empty() {
            let mut faulty = run.variant.faulty.lock().expect(UNPOISONED);
            if faulty.as_ref().is_none_or(|(first, _)| number < *first) {
                *faulty = Some((number, summary));
            }
        }
        Ok(Some(metrics))
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

/// Returns true for failures of an emulator, which Ctrl-C causes as well.
fn is_emulators(error: &RunFailure) -> bool {
    match error {
        RunFailure::Run(RunError::Firmware(_)) => true,
        RunFailure::Run(RunError::Scenario(error)) => {
            matches!(error.cause, ScenarioCause::Emulator { .. })
        }
        RunFailure::Defect(_) => false,
    }
}

fn row(run: &BatchRun, end: Result<Metrics, RunFailure>, columns: usize) -> RunRow {
    let parameters = run.variant.cells.clone();
    let (metrics, error) = match end {
        Ok(metrics) => (metrics, None),
        // The first metric is `success`.
        Err(error) => {
            let none = iter::repeat_n(None, columns - 1);
            (iter::once(Some(0.0)).chain(none).collect(), Some(error.to_string()))
        }
    };
    RunRow { seed: run.seed, parameters, metrics, error }
}

#[cfg(test)]
pub mod tests {
    use std::path::Path;

    use clap::Parser;

    use super::super::plan::ParameterPlaces;
    use super::*;

    pub const SCENARIO: &str = "[world]\nsize = [500, 500]\nduration = 1\n\
        [[robots]]\nrobot = \"kilobot\"\nscript = \"s.bzz\"\n";

    #[derive(Parser)]
    pub struct CommandLine {
        #[command(flatten)]
        pub sim: SimArguments,
    }

    pub fn variant(arguments: &SimArguments, settings: &[String]) -> Variant<'static> {
        let opened = open::open(arguments, settings, &ParameterPlaces::default());
        let opened = opened.unwrap().unwrap();
        Variant {
            point: &[],
            settings: settings.to_vec(),
            cells: Arc::default(),
            setup: Arc::new(opened.setup().unwrap()),
            opened,
            faulty: Mutex::default(),
        }
    }

    /// Simulates eight runs on `threads` threads, of which the third and the last have a defect.
    /// Returns the rows of the table, and the finished runs in the journal.
    fn simulate_with_defects(threads: usize) -> (Vec<RunRow>, Vec<usize>) {
        let folder = tempfile::tempdir().unwrap();
        let scenario = folder.path().join("s.toml");
        let table = folder.path().join("runs.csv");
        std::fs::write(&scenario, SCENARIO).unwrap();
        std::fs::write(folder.path().join("s.bzz"), "function step() { forward() }\n").unwrap();
        let line = [Path::new("sim"), &scenario, Path::new("--csv"), &table];
        let arguments = CommandLine::parse_from(line).sim;
        let variants = [variant(&arguments, &[])];
        let runs: Vec<BatchRun> =
            (1..=8).map(|seed| BatchRun { variant: &variants[0], seed }).collect();
        let columns = metrics::metrics(&variants[0].opened.scenario).len();
        let (journal, finished) = journal(&arguments, &variants, [runs.len(), columns]).unwrap();
        let batch = Batch {
            runs: &runs,
            simulate: &|run: &BatchRun, _| match run.seed {
                3 | 8 => panic!("robot {} is missing", run.seed),
                seed => run::complete(&run.variant.setup, seed, || false),
            },
            journal: journal.as_ref(),
            data: None,
            is_interrupted: &AtomicBool::new(false),
            done: AtomicUsize::new(0),
            progress: Mutex::new(Progress::new(8, true)),
        };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let ends = pool.install(|| batch.simulate(finished)).unwrap();
        print_failures(&arguments, &runs, &ends);
        let rows = ends.into_iter().map(|(number, end)| row(&runs[number], end, columns)).collect();
        let resumed = CommandLine::parse_from(line.into_iter().chain([Path::new("--resume")])).sim;
        drop(journal);
        let (_, kept) = self::journal(&resumed, &variants, [runs.len(), columns]).unwrap();
        (rows, kept.into_keys().collect())
    }

    #[test]
    fn a_defect_ends_one_run_and_the_others_are_kept() {
        for threads in [1, 2] {
            let (rows, kept) = simulate_with_defects(threads);
            let version = env!("CARGO_PKG_VERSION");
            for row in &rows {
                let metrics = &row.metrics;
                match row.seed {
                    3 | 8 => {
                        let error = row.error.as_ref().unwrap().replace('\\', "/");
                        let start = format!("defect of bbz {version} at bbz/src/sim/batch.rs:");
                        assert!(error.starts_with(&start), "{error}");
                        let end = format!(": robot {} is missing", row.seed);
                        assert!(error.ends_with(&end), "{error}");
                        assert_eq!(metrics[0], Some(0.0));
                        assert!(metrics[1..].iter().all(Option::is_none), "{metrics:?}");
                    }
                    _ => assert_eq!((&row.error, metrics[0]), (&None, Some(1.0))),
                }
            }
            assert_eq!(rows.len(), 8);
            assert_eq!(kept, [0, 1, 3, 4, 5, 6], "{threads} threads");
        }
    }
}
