//! Simulates many runs: every combination of the values of `--set`, with every seed.

use std::collections::BTreeMap;
use std::mem;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use annotate_snippets::{Group, Level};
use bittybuzz_arena::output::{RunRow, RunTable, metrics};
use bittybuzz_arena::run::{self, RunError, Setup, Summary};
use bittybuzz_arena::scenario::{Scenario, ScenarioCause};
use rayon::prelude::*;

use crate::exit::ExitStatus;
use crate::file_error::FileError;
use crate::interrupt::{self, Interrupt};
use crate::output;
use crate::problem::Problem;
use crate::report;
use crate::whole_file;

use super::arguments::SimArguments;
use super::journal::{self, Finished, Journal, Metrics};
use super::live::PATIENCE;
use super::open::{self, Opened};
use super::progress::Progress;
use super::variants::parts;
use super::{summary, table};

/// A reason why the runs cannot be a batch.
#[derive(Debug, thiserror::Error)]
enum BatchError {
    /// Values of `--set` that change the columns of the table.
    #[error("the values of `--set` change which columns the table has")]
    DifferentColumns,
    /// `--resume` with a table that goes to a stream.
    #[error("`{0}` is no file, so there is no batch to resume")]
    NothingToResume(PathBuf),
}

impl Problem for BatchError {
    fn help(&self) -> Option<String> {
        let help = match self {
            BatchError::DifferentColumns => "use `bbz sim` once for each, with a table of its own",
            BatchError::NothingToResume(_) => {
                "name a file, next to which finished runs can be kept"
            }
        };
        Some(help.to_owned())
    }
}

/// The time after which the finished runs of an incomplete part are written again.
const WRITE_AGAIN: Duration = Duration::from_secs(10);

/// A run of the batch.
struct BatchRun {
    variant: usize,
    seed: u32,
}

/// The results of runs, by number.
type Ends = BTreeMap<usize, Result<Metrics, RunError>>;

/// Runs every variant with every seed, and prints the usual results.
pub fn run(
    arguments: &SimArguments,
    variants: &[Vec<String>],
) -> Result<ExitStatus, Box<dyn Problem>> {
    let mut opened = Vec::new();
    for set in variants {
        let Some(variant) = open::open(arguments, set)? else {
            return Ok(ExitStatus::CompileError);
        };
        opened.push(variant);
    }
    let setups: Option<Vec<(Arc<Setup>, u32)>> = opened
        .iter()
        .map(|variant| {
            // A variant may set the seed.
            let seed = arguments.seed.unwrap_or(variant.scenario.world.seed);
            Some((Arc::new(variant.setup()?), seed))
        })
        .collect();
    let Some(setups) = setups else { return Ok(ExitStatus::CompileError) };
    let Some(first) = opened.first() else { return Ok(ExitStatus::Success) };
    let columns = metrics::names(&first.scenario);
    if opened.iter().any(|variant| metrics::names(&variant.scenario) != columns) {
        return Err(BatchError::DifferentColumns.into());
    }
    let seeds = arguments.runs.unwrap_or(1);
    let runs: Vec<BatchRun> = setups
        .iter()
        .enumerate()
        .flat_map(|(variant, (_, first))| {
            (0..seeds).map(move |run| BatchRun { variant, seed: first.wrapping_add(run) })
        })
        .collect();
    let interrupt = Interrupt::install()?;
    let (journal, finished) = journal(arguments, &opened, [runs.len(), columns.len()])?;
    if !finished.is_empty() {
        let title = format!("{} of {} runs were finished before", finished.len(), runs.len());
        report::print(Group::with_title(Level::NOTE.primary_title(title)));
    }
    let is_interrupted = interrupt.flag();
    let batch = Batch {
        scenario: &first.scenario,
        setups: &setups,
        runs: &runs,
        journal: journal.as_ref(),
        is_interrupted: &is_interrupted,
        done: AtomicUsize::new(finished.len()),
        progress: Mutex::new(Progress::new(
            runs.len() as u64,
            arguments.headless || arguments.json,
        )),
        faulty: Mutex::default(),
    };
    let ends = batch.simulate(finished)?;
    let Batch { progress, faulty, .. } = batch;
    if let Ok(progress) = progress.into_inner() {
        progress.finish();
    }
    print_failures(&runs, &ends);
    let is_complete = ends.len() == runs.len();
    let is_worldless = |end: &Result<_, RunError>| matches!(end, Err(RunError::Scenario(_)));
    if is_complete && ends.values().all(is_worldless) {
        journal.map_or(Ok(()), Journal::remove)?;
        return Ok(ExitStatus::CompileError);
    }
    let rows = ends.iter().filter_map(|(number, end)| {
        let run = runs.get(*number)?;
        Some(row(run, variants.get(run.variant)?, end, columns.len()))
    });
    let keys = variants.first().into_iter().flatten().map(|setting| parts(setting).0).collect();
    let table = RunTable { parameters: keys, rows: rows.collect(), metrics: columns.clone() };
    let kept = ends.values().filter(|end| end.is_ok()).count();
    let folder = journal.as_ref().map(|journal| journal.folder().to_owned());
    if let (Some(path), true) = (&arguments.csv, is_complete) {
        whole_file::write(path, table.to_csv().as_bytes())?;
    }
    if is_complete || kept == 0 {
        journal.map_or(Ok(()), Journal::remove)?;
    }
    let mut text = String::new();
    if arguments.json {
        text = table::json(&table).to_string() + "\n";
    } else {
        let faulty = faulty.into_inner().unwrap_or_default();
        for (variant, settings) in variants.iter().enumerate() {
            if let (Some((_, run)), Some(opened), Some((setup, _))) =
                (faulty.get(&variant), opened.get(variant), setups.get(variant))
            {
                summary::faults(setup, &opened.programs, run);
            }
            let is_own = |number: &usize| runs.get(*number).is_some_and(|r| r.variant == variant);
            let rows = ends.keys().zip(&table.rows).filter(|(number, _)| is_own(number));
            let rows: Vec<&RunRow> = rows.map(|(_, row)| row).collect();
            table::describe(&columns, &rows, settings, &mut text);
        }
    }
    output::write(&text)?;
    if !is_complete {
        print_interrupt([kept, runs.len()], folder.as_deref());
        return Ok(ExitStatus::Interrupted);
    }
    let is_success = |row: &RunRow| row.metrics.first() == Some(&Some(1.0));
    let is_success = table.rows.iter().all(is_success);
    Ok(if is_success { ExitStatus::Success } else { ExitStatus::RuntimeError })
}

/// Opens the journal of the table of `--csv`. A stream has none, because nothing stays in it.
fn journal(
    arguments: &SimArguments,
    opened: &[Opened],
    sizes: [usize; 2],
) -> Result<(Option<Journal>, Finished), Box<dyn Problem>> {
    let Some(path) = &arguments.csv else { return Ok((None, Finished::new())) };
    opened.iter().try_for_each(|variant| variant.inputs().refuse(path))?;
    if path.is_dir() {
        return Err(FileError::writing(path, std::io::ErrorKind::IsADirectory.into()).into());
    }
    if whole_file::is_stream(path) {
        return match arguments.resume {
            true => Err(BatchError::NothingToResume(path.clone()).into()),
            false => Ok((None, Finished::new())),
        };
    }
    let key = journal::key(arguments, opened)?;
    let (journal, finished) = Journal::open(path, &key, sizes, arguments.resume)?;
    Ok((Some(journal), finished))
}

/// The state that the threads of a batch share.
struct Batch<'a> {
    scenario: &'a Scenario,
    /// The setup of each variant, with its first seed.
    setups: &'a [(Arc<Setup>, u32)],
    runs: &'a [BatchRun],
    journal: Option<&'a Journal>,
    is_interrupted: &'a AtomicBool,
    /// The number of runs that have ended.
    done: AtomicUsize,
    progress: Mutex<Progress>,
    /// For each variant, the first run of this process in which a script had an error, with its
    /// number.
    faulty: Mutex<BTreeMap<usize, (usize, Summary)>>,
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
        for run in part {
            if finished.contains_key(&run) {
                continue;
            }
            match self.complete(run) {
                Ok(None) => break,
                Ok(Some(metrics)) => {
                    finished.insert(run, metrics);
                    is_written = false;
                }
                // The terminal sends Ctrl-C to emulators, too, and an emulator may end first.
                Err(error) if is_emulators(&error) && self.is_interrupted_within(PATIENCE) => break,
                Err(error) => {
                    failed.insert(run, Err(error));
                }
            }
            let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
            if let Ok(mut progress) = self.progress.lock() {
                progress.set(done as u64, |_| format!("{done} of {} runs", self.runs.len()));
            }
            if !is_written && written.elapsed() >= WRITE_AGAIN {
                write(&finished)?;
                (is_written, written) = (true, Instant::now());
            }
        }
        if !is_written {
            write(&finished)?;
        }
        failed.extend(finished.into_iter().map(|(run, metrics)| (run, Ok(metrics))));
        Ok(failed)
    }

    /// Simulates a run. Returns `None` if the batch was interrupted before the end of the run.
    fn complete(&self, number: usize) -> Result<Option<Metrics>, RunError> {
        let run = self.runs.get(number);
        let Some((run, (setup, _))) =
            run.and_then(|run| Some((run, self.setups.get(run.variant)?)))
        else {
            return Ok(None);
        };
        let is_interrupted = || self.is_interrupted.load(Ordering::Relaxed);
        let Some(summary) = run::complete(setup, run.seed, is_interrupted)? else {
            return Ok(None);
        };
        let metrics = metrics::values(self.scenario, &summary);
        if !summary.faults.is_empty()
            && let Ok(mut faulty) = self.faulty.lock()
        {
            let is_first = faulty.get(&run.variant).is_none_or(|(first, _)| number < *first);
            if is_first {
                faulty.insert(run.variant, (number, summary));
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
fn is_emulators(error: &RunError) -> bool {
    match error {
        RunError::Firmware(_) => true,
        RunError::Scenario(error) => matches!(error.cause, ScenarioCause::Emulator { .. }),
    }
}

fn row(run: &BatchRun, set: &[String], end: &Result<Metrics, RunError>, columns: usize) -> RunRow {
    let parameters = set.iter().map(|setting| parts(setting).1).collect();
    let (metrics, error) = match end {
        Ok(metrics) => (metrics.clone(), None),
        // The first metric is `success`.
        Err(error) => {
            let none = std::iter::repeat_n(None, columns.saturating_sub(1));
            ([Some(0.0)].into_iter().chain(none).collect(), Some(error.to_string()))
        }
    };
    RunRow { seed: run.seed, parameters, metrics, error }
}

/// Prints each cause of failed runs once, with the first run that it ended.
fn print_failures(runs: &[BatchRun], ends: &Ends) {
    let mut printed: Vec<(String, &RunError, u32, usize)> = Vec::new();
    for (number, end) in ends {
        let (Err(error), Some(run)) = (end, runs.get(*number)) else { continue };
        let text = error.to_string();
        match printed.iter_mut().find(|(known, ..)| *known == text) {
            Some((.., others)) => *others += 1,
            None => printed.push((text, error, run.seed, 0)),
        }
    }
    for (text, error, seed, others) in printed {
        let others = match others {
            0 => String::new(),
            1 => " (and another run)".to_owned(),
            others => format!(" (and {others} other runs)"),
        };
        let message = format!("the run with seed {seed}{others} has ended: {text}");
        match error {
            RunError::Scenario(error) => {
                report::mistake(&message, error.place.as_deref(), error.help());
            }
            RunError::Firmware(_) => report::mistake(&message, None, None),
        }
    }
}

/// Prints the number of finished runs of an interrupted batch, and the way to resume it.
fn print_interrupt([finished, total]: [usize; 2], folder: Option<&Path>) {
    let name = interrupt::NAME;
    let title = format!("stopped by {name}: {finished} of {total} runs are finished");
    report::print(Group::with_title(Level::NOTE.primary_title(title)));
    let help = match folder {
        _ if finished == 0 => return,
        Some(folder) => format!(
            "`{}` keeps them: the same command with --resume goes on",
            report::printable(&folder.display().to_string())
        ),
        None => "with --csv they are kept, and --resume goes on".to_owned(),
    };
    report::print(Group::with_title(Level::HELP.primary_title(help)));
}
