//! `bbz sweep run`: carries out chunks.

use std::path::PathBuf;
use std::process;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use annotate_snippets::{Group, Level};
use bittybuzz_arena::run::{RunWatcher, Setup};
use bittybuzz_chunks::{Found, Outcome};
use clap::Args;
use rayon::prelude::*;

use crate::chunks::{self, StoreProblem};
use crate::exit::ExitStatus;
use crate::interrupt::{self, Interrupt};
use crate::problem::Problem;
use crate::report;

use super::super::arguments::threads;
use super::super::batch::with_threads;
use super::super::stops::print_failures;
use super::super::work::{self, Ends, RunFailure, Work};
use super::folder;

/// Chunks that the plan does not have.
#[derive(Debug, thiserror::Error)]
enum RunError {
    #[error("there is no chunk {chunk}: the plan has chunks 0 to {}", .chunks - 1)]
    NoChunk { chunk: usize, chunks: usize },
}

impl Problem for RunError {}

/// A share of the chunks: number `of.0` of `of.1`, from 1.
#[derive(Debug, Clone, Copy)]
struct Shard(usize, usize);

/// Parses a share such as `2/3`.
fn shard(text: &str) -> Result<Shard, String> {
    let numbers = text
        .split_once('/')
        .and_then(|(number, of)| Some((number.trim().parse().ok()?, of.trim().parse().ok()?)));
    match numbers {
        Some((number, of)) if (1..=of).contains(&number) => Ok(Shard(number, of)),
        _ => Err(format!("{text} is no share such as 1/4: of four shares, they are 1/4 to 4/4")),
    }
}

/// Successive chunks: the first and the last.
#[derive(Debug, Clone, Copy)]
struct ChunkRange(usize, usize);

/// Parses a chunk or a range such as `3-7`.
fn chunk_range(text: &str) -> Result<ChunkRange, String> {
    let (first, last) = text.split_once('-').unwrap_or((text, text));
    match (first.trim().parse(), last.trim().parse()) {
        (Ok(first), Ok(last)) if first <= last => Ok(ChunkRange(first, last)),
        _ => Err(format!("{text} is neither a chunk nor a range such as 3-7")),
    }
}

/// Arguments of `bbz sweep run`.
#[derive(Debug, Args)]
pub struct RunArguments {
    /// Folder of `bbz sweep plan`
    folder: PathBuf,
    /// Carry out this chunk, from 0, or these, such as 3-7; may be given several times [default: all]
    #[arg(long, value_name = "N|N-M", conflicts_with = "shard", value_parser = chunk_range)]
    chunk: Vec<ChunkRange>,
    /// Carry out one of several equal shares of the chunks, such as 1/4
    #[arg(long, value_name = "I/N", value_parser = shard)]
    shard: Option<Shard>,
    /// Carry out runs again that could not go on
    #[arg(long)]
    retry: bool,
    /// Number of threads that simulate [default: one per core]
    #[arg(long, value_name = "N", value_parser = threads)]
    threads: Option<usize>,
    /// Print no progress
    #[arg(long)]
    headless: bool,
}

/// Carries out the command.
pub fn execute(arguments: &RunArguments) -> Result<ExitStatus, Box<dyn Problem>> {
    let store = folder::open(&arguments.folder)?;
    let plan = store.plan();
    let mut sim = folder::arguments(&arguments.folder, plan);
    sim.headless = arguments.headless;
    let Some(study) = folder::study(&sim, &store)? else { return Ok(ExitStatus::CompileError) };
    let mut chunks = chunks(arguments, plan.chunks())?;
    // Processes that carry out the same chunks meet less if each begins elsewhere.
    let begin = process::id() as usize % chunks.len().max(1);
    chunks.rotate_left(if arguments.chunk.is_empty() { begin } else { 0 });
    let interrupt = Interrupt::install()?;
    let is_interrupted = interrupt.flag();
    let simulate = |setup: &Arc<Setup>, seed: u32, watcher: &mut dyn RunWatcher| {
        work::complete(setup, seed, watcher, &is_interrupted)
    };
    let total = chunks.iter().map(|chunk| plan.runs_of(*chunk).len()).sum();
    let mut work = Work::new(&study, &simulate, &is_interrupted, total);
    work.store = Some(&store);
    let (missing, failed) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let carry_out = |chunk: usize| -> Result<Ends, Box<dyn Problem>> {
        let runs = plan.runs_of(chunk);
        if is_interrupted.load(Ordering::Relaxed) {
            missing.fetch_add(runs.len(), Ordering::Relaxed);
            return Ok(Ends::new());
        }
        let found = store.chunk(chunk, |run| study.runs.key(run)).map_err(StoreProblem)?;
        let Found { mut outcomes, aside } = found;
        chunks::print_aside(&aside);
        if arguments.retry {
            outcomes.retain(|_, outcome| matches!(outcome, Outcome::Complete { .. }));
        }
        // A chunk of which all runs were known before, from an earlier plan, is written, too.
        let is_known = outcomes.len() == runs.len();
        if is_known && !store.has_chunk(chunk).map_err(StoreProblem)? {
            store.write(chunk, &outcomes, |run| study.runs.key(run)).map_err(StoreProblem)?;
        }
        let count = runs.len();
        let mut ends = work.chunk(chunk, runs, outcomes)?;
        missing.fetch_add(count - ends.len(), Ordering::Relaxed);
        // Results stay in the folder: a sweep may be larger than the memory.
        ends.retain(|_, end| end.is_err());
        failed.fetch_add(ends.len(), Ordering::Relaxed);
        Ok(ends)
    };
    let carried_out = with_threads(arguments.threads, || {
        chunks.into_par_iter().map(carry_out).collect::<Result<Vec<Ends>, Box<dyn Problem>>>()
    })?;
    let failures: Ends = carried_out?.into_iter().flatten().collect();
    work.finish();
    print_failures(&study.runs, &sim, &failures);
    let (missing, failed) = (missing.into_inner(), failed.into_inner());
    if missing > 0 {
        let title = format!(
            "stopped by {}: {} of {total} runs are finished",
            interrupt::NAME,
            total - missing
        );
        report::print(Group::with_title(Level::NOTE.primary_title(title)));
        return Ok(ExitStatus::Interrupted);
    }
    let is_before = |end: &Result<_, RunFailure>| matches!(end, Err(RunFailure::Before(_)));
    if failures.values().any(is_before) {
        let help = "--retry carries them out again".to_owned();
        report::print(Group::with_title(Level::HELP.primary_title(help)));
    }
    Ok(if failed == 0 { ExitStatus::Success } else { ExitStatus::RuntimeError })
}

/// Returns the chunks that the command line names.
fn chunks(arguments: &RunArguments, chunks: usize) -> Result<Vec<usize>, RunError> {
    let named = &arguments.chunk;
    if let Some(ChunkRange(_, chunk)) = named.iter().find(|ChunkRange(_, last)| *last >= chunks) {
        return Err(RunError::NoChunk { chunk: *chunk, chunks });
    }
    Ok(match (&named[..], arguments.shard) {
        ([], None) => (0..chunks).collect(),
        // Successive chunks: an engine that takes one after the other opens each point once.
        ([], Some(Shard(number, of))) => {
            ((number - 1) * chunks / of..number * chunks / of).collect()
        }
        (named, _) => named.iter().flat_map(|ChunkRange(first, last)| *first..*last + 1).collect(),
    })
}
