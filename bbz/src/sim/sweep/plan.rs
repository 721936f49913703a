//! `bbz sweep plan`: the list of runs.

use std::fs;
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use bittybuzz_arena::run;
use bittybuzz_chunks::{Folder, Store};
use clap::Args;

use crate::chunks::{self, Names, StoreProblem};
use crate::exit::ExitStatus;
use crate::file_error::FileError;
use crate::output;
use crate::problem::Problem;

use super::super::arguments::SimArguments;
use super::super::plan::{self, RUNS_MAX};
use super::super::source;
use super::super::study::Study;
use super::super::{check_seed, experiment};

/// The time that a chunk takes, in s, unless another is asked for: the overhead of a process is then far
/// below one percent, and a process that is killed loses little.
const CHUNK_SECONDS: f64 = 10.0;

/// A folder that cannot take a plan.
#[derive(Debug, thiserror::Error)]
enum PlanError {
    #[error("`{0}` holds other files than a sweep's")]
    OtherFiles(PathBuf),
    /// A script, which says nothing of robots and world.
    #[error("`{0}` is a script, and a sweep needs a scenario")]
    Script(PathBuf),
    /// A scenario whose name does not name a folder.
    #[error("`{0}` gives the folder of the sweep no name")]
    NoName(PathBuf),
}

impl Problem for PlanError {
    fn help(&self) -> Option<String> {
        Some(match self {
            PlanError::Script(_) => {
                "`bbz new FOLDER --robot NAME` makes one, and docs/scenario.md describes them"
                    .to_owned()
            }
            _ => "name a new folder with --folder".to_owned(),
        })
    }
}

/// Parses a time in s.
fn seconds(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|number: &f64| *number > 0.0 && number.is_finite());
    number.ok_or_else(|| format!("{text} is not a time in seconds above 0"))
}

/// Arguments of `bbz sweep plan`.
#[derive(Debug, Args)]
pub struct PlanArguments {
    /// Scenario (*.toml)
    scenario: PathBuf,
    /// Folder of the sweep [default: next to the scenario, with its name and .sweep]
    #[arg(long, value_name = "FOLDER")]
    folder: Option<PathBuf>,
    /// Number of runs of each combination of values [default: that of [sweep], or 1]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(RUNS_MAX)))]
    runs: Option<u32>,
    /// Values of a key, as for `bbz sim`
    #[arg(long, value_name = "KEY=V1,V2...")]
    set: Vec<String>,
    /// Seed of all chance [default: that of the scenario]
    #[arg(long, value_name = "N")]
    seed: Option<u32>,
    /// Number of runs of a chunk [default: that of the earlier plan, or from --chunk-seconds]
    #[arg(long, value_name = "N", conflicts_with = "chunk_seconds", value_parser = clap::value_parser!(u32).range(1..=i64::from(RUNS_MAX)))]
    chunk: Option<u32>,
    /// Time of a chunk, from a run that is measured [default: 10; 200 suits Slurm]
    #[arg(long, value_name = "S", value_parser = seconds)]
    chunk_seconds: Option<f64>,
    /// Folder to search for included files; may be given several times
    #[arg(short = 'I', value_name = "DIR")]
    include: Vec<PathBuf>,
}

/// Carries out the command.
pub fn execute(arguments: &PlanArguments) -> Result<ExitStatus, Box<dyn Problem>> {
    let mut sim = SimArguments::of_sweep(
        arguments.scenario.clone(),
        arguments.include.clone(),
        arguments.seed,
    );
    (sim.runs, sim.set) = (arguments.runs, arguments.set.clone());
    if source::is_script(&sim.scenario) {
        return Err(PlanError::Script(sim.scenario).into());
    }
    let axes = plan::axes(&sim.set)?;
    check_seed(&sim, &axes)?;
    let Some(study) = Study::open(&sim, axes)? else { return Ok(ExitStatus::CompileError) };
    let folder = match &arguments.folder {
        Some(folder) => folder.clone(),
        None => match arguments.scenario.file_stem() {
            Some(stem) if arguments.scenario.is_file() => {
                let mut name = stem.to_owned();
                name.push(".sweep");
                arguments.scenario.with_file_name(name)
            }
            _ => return Err(PlanError::NoName(arguments.scenario.clone()).into()),
        },
    };
    fs::create_dir_all(&folder).map_err(|error| FileError::writing(&folder, error))?;
    if !Names::of(&folder)?.others.is_empty() {
        return Err(PlanError::OtherFiles(folder).into());
    }
    let old = Store::open(Folder(folder.clone())).map_err(StoreProblem)?;
    let runs = study.runs.count();
    let chunk = match (arguments.chunk, arguments.chunk_seconds, &old) {
        (Some(chunk), ..) => chunk,
        (None, None, Some(old)) => old.plan().chunk,
        (None, time, _) => measured_chunk(&study, time.unwrap_or(CHUNK_SECONDS)),
    };
    let plan = experiment::plan(&study, &folder, chunk)?;
    let (store, found) = Store::create(Folder(folder.clone()), plan, |run| study.runs.key(run))
        .map_err(StoreProblem)?;
    chunks::print_aside(&found.aside);
    let (points, chunks) = (study.runs.plan.points.len(), store.plan().chunks());
    let mut text = format!("{}: {points} points, {runs} runs in {chunks} chunks", folder.display());
    if !found.outcomes.is_empty() {
        text += &format!("; {} runs are finished", found.outcomes.len());
    }
    output::write(&format!("{text}\n"))?;
    Ok(ExitStatus::Success)
}

/// Measures the first run, and returns the number of runs that take this time.
fn measured_chunk(study: &Study, seconds: f64) -> u32 {
    let start = Instant::now();
    // A run that fails takes a time, too, and is a row later.
    let _ = super::super::work::complete(
        &study.first.setup,
        study.runs.seed(0),
        &mut |_: &run::Simulation| {},
        &AtomicBool::new(false),
    );
    let of_run = start.elapsed().as_secs_f64().max(1e-6);
    (seconds / of_run).ceil().clamp(1.0, f64::from(RUNS_MAX)) as u32
}
