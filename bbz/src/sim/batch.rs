//! Simulates many runs: every point of a plan, with every seed.

use std::collections::BTreeMap;
use std::iter;
use std::mem;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use annotate_snippets::{Group, Level};
use bittybuzz_arena::output::{RunRow, RunTable};
use bittybuzz_arena::run::{RunError, RunWatcher, Setup};
use bittybuzz_arena::sweep::{Axis, Chance, Plan};
use bittybuzz_chunks::{Found, Outcome};
use rayon::prelude::*;

use crate::chunks;
use crate::escape::escaped;
use crate::exit::ExitStatus;
use crate::file_error::FileError;
use crate::interrupt::Interrupt;
use crate::output;
use crate::problem::Problem;
use crate::report;
use crate::whole_file;

use super::arguments::SimArguments;
use super::data::BatchData;
use super::journal::{self, Journal};
use super::runs::Runs;
use super::stops::{print_failures, print_interrupt};
use super::study::Study;
use super::table;
use super::work::{self, Ends, RunFailure, RunResult, Work};

/// A reason why the runs cannot be a batch.
#[derive(Debug, thiserror::Error)]
enum BatchError {
    /// The system gives no threads.
    #[error("cannot start threads: {0}")]
    Threads(String),
    /// `--resume` with a table that goes to a stream.
    #[error("`{0}` is no file, so there is no batch to resume")]
    NothingToResume(PathBuf),
    /// `--resume` with other runs than before, whose numbers would not be those in the tables of `--data`.
    #[error("the tables of --data have the runs of a batch with other --runs or values of --set")]
    OtherData,
}

impl Problem for BatchError {
    fn help(&self) -> Option<String> {
        let help = match self {
            BatchError::Threads(_) => "ask for fewer with --threads",
            BatchError::NothingToResume(_) => {
                "name a file, next to which finished runs can be kept"
            }
            BatchError::OtherData => {
                "give the options that it was started with, or leave out --data"
            }
        };
        Some(help.to_owned())
    }
}

/// Calls `work` with a number of threads, or with one for each core.
pub fn with_threads<T: Send>(
    threads: Option<usize>,
    work: impl FnOnce() -> T + Send,
) -> Result<T, Box<dyn Problem>> {
    let Some(threads) = threads else { return Ok(work()) };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let pool = pool.map_err(|error| BatchError::Threads(error.to_string()))?;
    Ok(pool.install(work))
}

/// Runs every point with every seed, and prints the usual results.
pub fn run(arguments: &SimArguments, axes: Vec<Axis>) -> Result<ExitStatus, Box<dyn Problem>> {
    let (status, text) = complete(arguments, axes, None)?;
    output::write(&text)?;
    Ok(status)
}

/// Runs every point with every seed, and writes the files of the command line. Returns the usual results.
/// `output` is a file that the caller will write, which must be none that the runs read.
pub fn complete(
    arguments: &SimArguments,
    axes: Vec<Axis>,
    output: Option<&Path>,
) -> Result<(ExitStatus, String), Box<dyn Problem>> {
    let none = |status| Ok((status, String::new()));
    let Some(study) = Study::open(arguments, axes)? else { return none(ExitStatus::CompileError) };
    if let Some(path) = output {
        study.inputs()?.refuse(path)?;
    }
    let interrupt = Interrupt::install()?;
    let (journal, found) = journal(&study)?;
    chunks::print_aside(&found.aside);
    let mut known = found.outcomes;
    // A run that failed is simulated again.
    known.retain(|_, outcome| matches!(outcome, Outcome::Complete { .. }));
    let data = match &arguments.data {
        None => None,
        Some(_) if journal.as_ref().is_some_and(|journal| journal.has_grown) => {
            return Err(BatchError::OtherData.into());
        }
        Some(path) => {
            let scenario = &study.first.opened.scenario;
            Some(BatchData::create(path, &study.runs.plan, scenario, arguments.resume)?)
        }
    };
    if !known.is_empty() {
        let title = format!("{} of {} runs were finished before", known.len(), study.runs.count());
        report::print(Group::with_title(Level::NOTE.primary_title(title)));
    }
    let is_interrupted = interrupt.flag();
    let simulate = |setup: &Arc<Setup>, seed: u32, watcher: &mut dyn RunWatcher| {
        work::complete(setup, seed, watcher, &is_interrupted)
    };
    let mut work = Work::new(&study, &simulate, &is_interrupted, study.runs.count());
    work.store = journal.as_ref().map(|journal| &journal.store);
    work.data = data.as_ref();
    let ends = with_threads(arguments.threads, || carry_out(&work, known))??;
    work.finish();
    print_failures(&study.runs, arguments, &ends);
    let is_complete = ends.len() == study.runs.count();
    let is_worldless =
        |end: &Result<_, RunFailure>| matches!(end, Err(RunFailure::Run(RunError::Scenario(_))));
    if is_complete && ends.values().all(is_worldless) {
        journal.map_or(Ok(()), Journal::remove)?;
        return none(ExitStatus::CompileError);
    }
    let kept = ends.values().filter(|end| end.is_ok()).count();
    let metrics = study.metrics.iter().map(|metric| metric.name.clone()).collect();
    let (numbers, table) = self::table(&study.runs, metrics, ends);
    let folder = journal.as_ref().map(|journal| journal.folder().to_owned());
    if let (Some(path), true) = (&arguments.csv, is_complete) {
        whole_file::write(path, escaped(&table.to_csv()).as_bytes())?;
    }
    if is_complete || kept == 0 {
        journal.map_or(Ok(()), Journal::remove)?;
    }
    let text = match arguments.json {
        true => table::json(&table).to_string() + "\n",
        false => describe(&study, &numbers, &table),
    };
    if !is_complete {
        print_interrupt([kept, study.runs.count()], folder.as_deref());
        return Ok((ExitStatus::Interrupted, text));
    }
    // A failed expectation is a result of the runs, and counted there. An engine that schedules many
    // batches would take another status as a reason to repeat this one.
    let have_ended = table.rows.iter().all(|row| row.error.is_none());
    let status = if have_ended { ExitStatus::Success } else { ExitStatus::RuntimeError };
    Ok((status, text))
}

/// Carries out all runs that are not `known`, until all are finished or the batch is interrupted.
fn carry_out(
    work: &Work<'_>,
    mut known: BTreeMap<usize, Outcome>,
) -> Result<Ends, Box<dyn Problem>> {
    let runs = work.study.runs.count();
    let size = journal::chunk(runs) as usize;
    let chunks = (0..runs).step_by(size).enumerate();
    let chunks: Vec<_> = chunks
        .map(|(number, first)| {
            let end = runs.min(first + size);
            let later = known.split_off(&end);
            (number, first..end, mem::replace(&mut known, later))
        })
        .collect();
    let ends: Result<Vec<Ends>, Box<dyn Problem>> = chunks
        .into_par_iter()
        .map(|(number, runs, known)| work.chunk(number, runs, known))
        .collect();
    Ok(ends?.into_iter().flatten().collect())
}

/// Returns the table of runs, and their numbers in the plan.
pub fn table(runs: &Runs, metrics: Vec<String>, ends: Ends) -> (Vec<usize>, RunTable) {
    let mut cells = (usize::MAX, Default::default());
    let rows = ends.into_iter().map(|(number, end)| {
        let point = runs.point_of(number);
        if cells.0 != point {
            cells = (point, runs.cells(point));
        }
        let (metrics, digest, error) = match end {
            Ok(RunResult { metrics, digest }) => (metrics, Some(digest), None),
            // The first metric is `success`.
            Err(error) => {
                let none = iter::repeat_n(None, metrics.len() - 1);
                (iter::once(Some(0.0)).chain(none).collect(), None, Some(error.to_string()))
            }
        };
        let parameters = cells.1.clone();
        (number, RunRow { seed: runs.seed(number), parameters, metrics, digest, error })
    });
    let (numbers, rows) = rows.unzip();
    (numbers, RunTable { parameters: runs.columns(), rows, metrics })
}

/// Describes the runs of each point.
fn describe(study: &Study, numbers: &[usize], table: &RunTable) -> String {
    let mut text = String::new();
    if study.first.opened.scenario.sweep.is_some() {
        text += &describe_plan(&study.runs.plan);
    }
    for point in 0..study.runs.plan.points.len() {
        // The runs of a point have successive numbers, and an interrupted batch lacks some.
        let [from, to] = [point, point + 1].map(|point| {
            let number = point * study.runs.plan.replicates as usize;
            numbers.partition_point(|known| *known < number)
        });
        let rows: Vec<&RunRow> = table.rows[from..to].iter().collect();
        let cells = study.runs.cells(point);
        let parts = study.runs.plan.parameters.iter().zip(&*cells);
        let parts = parts.map(|(parameter, cell)| format!("{}={cell}", parameter.name));
        let name = parts.collect::<Vec<String>>().join(" ");
        table::describe(&study.metrics, &rows, &name, study.duration(point), &mut text);
    }
    text
}

/// Describes the points of a study, and their chance.
pub fn describe_plan(plan: &Plan) -> String {
    let (points, runs) = (plan.points.len(), plan.replicates);
    let chance = match plan.chance {
        Chance::Common => "all points have the same seeds (common random numbers)",
        Chance::Independent => "each point has seeds of its own (independent)",
    };
    format!("[sweep]: {points} points, {runs} runs of each; {chance}\n")
}

/// Opens the journal of the table of `--csv`. A stream has none, because nothing stays in it.
fn journal(study: &Study) -> Result<(Option<Journal>, Found), Box<dyn Problem>> {
    let arguments = study.arguments;
    let Some(path) = &arguments.csv else { return Ok((None, Found::default())) };
    study.inputs()?.refuse(path)?;
    if path.is_dir() {
        return Err(FileError::writing(path, std::io::ErrorKind::IsADirectory.into()).into());
    }
    if whole_file::is_stream(path) {
        return match arguments.resume {
            true => Err(BatchError::NothingToResume(path.clone()).into()),
            false => Ok((None, Found::default())),
        };
    }
    let (journal, found) = Journal::open(path, study, arguments.resume)?;
    Ok((Some(journal), found))
}

#[cfg(test)]
pub mod tests {
    use std::sync::atomic::AtomicBool;

    use bittybuzz_arena::run;
    use clap::Parser;

    use super::*;

    pub const SCENARIO: &str = "[world]\nsize = [500, 500]\nduration = 1\n\
        [[robots]]\nrobot = \"kilobot\"\nscript = \"s.bzz\"\n";

    #[derive(Parser)]
    pub struct CommandLine {
        #[command(flatten)]
        pub sim: SimArguments,
    }

    /// Simulates eight runs on `threads` threads, of which the third and the last have a defect.
    /// Returns the rows of the table, and the runs in the journal that are complete.
    fn simulate_with_defects(threads: usize) -> (Vec<RunRow>, Vec<usize>) {
        let folder = tempfile::tempdir().unwrap();
        let scenario = folder.path().join("s.toml");
        let table = folder.path().join("runs.csv");
        std::fs::write(&scenario, SCENARIO).unwrap();
        std::fs::write(folder.path().join("s.bzz"), "function step() { forward() }\n").unwrap();
        let line = ["sim", "--seed", "1", "--runs", "8", "--csv"].map(Path::new);
        let arguments = CommandLine::parse_from(line.into_iter().chain([&*table, &*scenario])).sim;
        let study = Study::open(&arguments, Vec::new()).unwrap().unwrap();
        let (journal, found) = journal(&study).unwrap();
        let simulate = |setup: &Arc<Setup>, seed: u32, watcher: &mut dyn RunWatcher| match seed {
            3 | 8 => panic!("robot {seed} is missing"),
            seed => run::complete_watched(setup, seed, || false, watcher),
        };
        let is_interrupted = AtomicBool::new(false);
        let mut work = Work::new(&study, &simulate, &is_interrupted, 8);
        work.store = journal.as_ref().map(|journal| &journal.store);
        let ends = with_threads(Some(threads), || carry_out(&work, found.outcomes));
        let ends = ends.unwrap().unwrap();
        print_failures(&study.runs, &arguments, &ends);
        let metrics = study.metrics.iter().map(|metric| metric.name.clone()).collect();
        let (_, table) = self::table(&study.runs, metrics, ends);
        let kept = journal.unwrap().store.all(|run| study.runs.key(run)).unwrap().outcomes;
        let kept = kept.into_iter().filter(|(_, end)| matches!(end, Outcome::Complete { .. }));
        (table.rows, kept.map(|(run, _)| run).collect())
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
