//! `bbz sim`: simulates the robots of a scenario.

mod batch;
mod checks;
pub mod desk;
mod journal;
mod live;
mod open;
mod progress;
mod recorder;
mod summary;
mod table;
#[cfg(feature = "view")]
mod values;
mod variants;
#[cfg(feature = "view")]
mod view;

use std::path::PathBuf;

use clap::Args;

use crate::ExitStatus;
use crate::problem::Problem;

/// The most runs of one command. Their results, some kilobytes each, are kept until the last run
/// ends.
pub const MOST_RUNS: u32 = 100_000;

/// The key of the seed in a scenario.
const SEED: &str = "world.seed";

const EXAMPLES: &str = "\
Examples:
  bbz sim swarm.toml                     run it: log lines, then a summary
  bbz sim swarm.toml --view              show it in a page, and steer it there
  bbz sim swarm.toml --view --edit       the page may also write its scripts
  bbz sim swarm.toml --seed 7            the same world with other chance
  bbz sim swarm.toml --svg pictures      draw trajectories, and what [output] names over time
  bbz sim swarm.toml --record run.bbr    keep poses and LEDs of every robot
  bbz sim swarm.toml --set medium.ir.loss=0.3    another value than the file's
  bbz sim swarm.toml --runs 20 --set medium.ir.loss=0,0.3 --csv runs.csv    compare 40 runs
  bbz sim swarm.toml --runs 2000 --csv runs.csv --resume    go on after Ctrl-C or a crash
  bbz sim zooids.toml --set robots.0.backend=firmware    the robots' own image, emulated
  bbz sim swarm.toml --checks            also report numbers that wrapped, memory and cycles
  bbz sim swarm.toml --headless --json   for programs that read the result

docs/scenario.md describes scenario files.

Exit status: 0 every [[expect]] held, 1 one did not or a script had an error that none counts, 2 the scenario is wrong
or a script does not compile, 3 wrong command line or file, 130 many runs were stopped by Ctrl-C or SIGTERM.";

/// Arguments of `bbz sim`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct SimArguments {
    /// Scenario (*.toml)
    scenario: PathBuf,
    /// Seed of all chance [default: that of the scenario]
    #[arg(long, value_name = "N")]
    seed: Option<u32>,
    /// Show the run in a page on this computer, where it can be stopped, taken back and changed
    #[cfg(feature = "view")]
    #[arg(long, conflicts_with_all = ["headless", "json", "checks", "record", "svg", "runs", "csv"])]
    view: bool,
    /// Let the page write scripts of the scenario back to their files
    #[cfg(feature = "view")]
    #[arg(long, requires = "view")]
    edit: bool,
    /// Print the address of the page and open no browser
    #[cfg(feature = "view")]
    #[arg(long, requires = "view")]
    no_browser: bool,
    /// Print no log lines and no progress, only the result
    #[arg(long)]
    headless: bool,
    /// Print the result as JSON, and no log lines
    #[arg(long)]
    json: bool,
    /// Report numbers that did not fit their type, and the memory and cycles that scripts needed; results stay the same
    #[arg(long, conflicts_with_all = ["runs", "csv"])]
    checks: bool,
    /// Write a recording of every robot to a file
    #[arg(long, value_name = "OUT", conflicts_with_all = ["runs", "csv"])]
    record: Option<PathBuf>,
    /// Write pictures to a folder
    #[arg(long, value_name = "DIR", conflicts_with_all = ["runs", "csv"])]
    svg: Option<PathBuf>,
    /// Number of runs, with one seed after the other
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(MOST_RUNS)))]
    runs: Option<u32>,
    /// Take other values than the file's for a key such as `medium.ir.loss`; with several every combination is simulated
    #[arg(long, value_name = "KEY=V1,V2...")]
    set: Vec<String>,
    /// Program that emulates robots with backend = "firmware" [default: bbz-emulate-m0, for Kilobots bbz-emulate-avr]
    #[arg(long, value_name = "PROGRAM")]
    emulator: Option<PathBuf>,
    /// Write a table with a row for each run
    #[arg(long, value_name = "OUT")]
    csv: Option<PathBuf>,
    /// Go on with the batch that was to write the table of --csv and was stopped, if there is one
    #[arg(long, requires = "csv")]
    resume: bool,
    /// Folder to search for included files; may be given several times
    #[arg(short = 'I', value_name = "DIR")]
    include: Vec<PathBuf>,
}

/// Carries out the command.
pub fn execute(arguments: &SimArguments) -> Result<ExitStatus, Problem> {
    let sets_seed = |set: &String| set.split('=').next().is_some_and(|key| key.trim() == SEED);
    if arguments.seed.is_some() && arguments.set.iter().any(sets_seed) {
        return Err(Problem::TwoSeeds);
    }
    let variants = variants::variants(&arguments.set, arguments.runs.unwrap_or(1))?;
    match variants.as_slice() {
        #[cfg(feature = "view")]
        [only] if arguments.view => view::run(arguments, only),
        [only] if arguments.runs.is_none() && arguments.csv.is_none() => live::run(arguments, only),
        #[cfg(feature = "view")]
        _ if arguments.view => Err(Problem::ViewOfMany),
        _ if arguments.checks => Err(Problem::ChecksOfMany),
        _ => batch::run(arguments, &variants),
    }
}
