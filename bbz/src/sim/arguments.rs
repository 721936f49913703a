//! The command line of `bbz sim`.

use std::path::PathBuf;

use clap::Args;

use super::plan::RUNS_MAX;

/// The key of the seed in a scenario.
pub(super) const SEED: &str = "world.seed";

const EXAMPLES: &str = "\
Examples:
  bbz sim swarm.toml                     run it: log lines, then a summary
  bbz sim swarm.toml --view              show it in a page, and steer it there
  bbz sim hello.bzz --robot kilobot --count 20 --view    a script without a scenario: 20 robots on a square
  bbz sim swarm.toml --view --read-only  the page writes no script
  bbz sim swarm.toml --seed 7            the same world with other chance
  bbz sim swarm.toml --svg pictures      draw trajectories, and what [output] names over time
  bbz sim swarm.toml --record run.bbr    keep poses and LEDs of every robot
  bbz sim swarm.toml --data run          tables of every robot for Python, R or a spreadsheet
  bbz sim swarm.toml --set medium.ir.loss=0.3    another value than the file's
  bbz sim swarm.toml --runs 20 --set medium.ir.loss=0,0.3 --csv runs.csv    compare 40 runs
  bbz sim swarm.toml --runs 20 --set robots.walkers.globals.GROUP=1:9:2    a group's global; columns have its name
  bbz sim study.toml --csv runs.csv      the runs of its [sweep]
  bbz sim swarm.toml --runs 2000 --csv runs.csv --resume    go on after Ctrl-C or a crash
  bbz sim zooids.toml --set robots.0.backend=firmware    the robots' own image, emulated
  bbz sim swarm.toml --checks            also report numbers that wrapped, memory and cycles
  bbz sim swarm.toml --headless --json   for programs that read the result

docs/scenario.md describes scenario files.

Exit status of one run: 0 every [[expect]] held, 1 one did not or a script had an error that none counts.
Exit status of many runs (--runs, --csv, several values of --set): 0 all ended, and failed expectations are counted in
the result, 1 one could not go on, 130 stopped by Ctrl-C or SIGTERM.
Of both: 2 the scenario is wrong or a script does not compile, 3 wrong command line or file.";

/// Parses a number of threads.
pub(super) fn threads(text: &str) -> Result<usize, String> {
    let number = text.parse().ok().filter(|number| (1..=THREADS_MAX).contains(number));
    number.ok_or_else(|| format!("{text} is not in 1..={THREADS_MAX}"))
}

/// The most threads of a simulation. More would only wait for each other.
const THREADS_MAX: usize = 4096;

/// Arguments of `bbz sim`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct SimArguments {
    /// Scenario (*.toml), or with --robot a script
    pub(super) scenario: PathBuf,
    /// Robot of a script without a scenario: its name (see `bbz robots`) or the path of a robot file (*.toml)
    #[arg(long, value_name = "NAME|PATH.toml")]
    pub(super) robot: Option<String>,
    /// Number of robots of a script without a scenario [default: 10]
    #[arg(long, value_name = "N", requires = "robot", value_parser = clap::value_parser!(u32).range(1..=65_536))]
    pub(super) count: Option<u32>,
    /// Seed of all chance [default: that of the scenario]
    #[arg(long, value_name = "N")]
    pub(super) seed: Option<u32>,
    /// Show the run in a page on this computer, where it can be stopped, taken back and changed
    #[cfg(feature = "view")]
    #[arg(long, conflicts_with_all = ["headless", "json", "checks", "record", "svg", "data", "runs", "csv"])]
    pub(super) view: bool,
    /// Let the page write no script; without this option `Save` writes those of the scenario
    #[cfg(feature = "view")]
    #[arg(long, requires = "view")]
    pub(super) read_only: bool,
    /// Print the address of the page and open no browser
    #[cfg(feature = "view")]
    #[arg(long, requires = "view")]
    pub(super) no_browser: bool,
    /// Print no log lines and no progress, only the result
    #[arg(long)]
    pub(super) headless: bool,
    /// Print the result as JSON, and no log lines
    #[arg(long)]
    pub(super) json: bool,
    /// Report numbers that did not fit their type, and the memory and cycles that scripts needed; results stay the same
    #[arg(long, conflicts_with_all = ["runs", "csv"])]
    pub(super) checks: bool,
    /// Write a recording of every robot to a file
    #[arg(long, value_name = "OUT", conflicts_with_all = ["runs", "csv"])]
    pub(super) record: Option<PathBuf>,
    /// Write pictures to a folder
    #[arg(long, value_name = "DIR", conflicts_with_all = ["runs", "csv"])]
    pub(super) svg: Option<PathBuf>,
    /// Write tables of the runs: robots, logs, faults and events as Parquet to a folder, or robots as CSV to a file
    #[arg(long, value_name = "DIR|OUT.csv")]
    pub(super) data: Option<PathBuf>,
    /// Number of runs of each combination of values, with one seed after the other
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(RUNS_MAX)))]
    pub(super) runs: Option<u32>,
    /// Take other values than the file's for a key such as `medium.ir.loss`; with several (also 1:9:2) every combination is
    /// simulated, and keys of one --set (`A=1,2; B=3,4`) vary together
    #[arg(long, value_name = "KEY=V1,V2...")]
    pub(super) set: Vec<String>,
    /// Number of threads that simulate, for results that do not depend on it [default: one per core]
    #[arg(long, value_name = "N", value_parser = threads)]
    pub(super) threads: Option<usize>,
    /// Program that emulates robots with backend = "firmware" [default: bbz-emulate-m0, for Kilobots bbz-emulate-avr]
    #[arg(long, value_name = "PROGRAM")]
    pub(super) emulator: Option<PathBuf>,
    /// Write a table with a row for each run
    #[arg(long, value_name = "OUT")]
    pub(super) csv: Option<PathBuf>,
    /// Go on with the batch that was to write the table of --csv and was stopped, if there is one
    #[arg(long, requires = "csv")]
    pub(super) resume: bool,
    /// Folder to search for included files; may be given several times
    #[arg(short = 'I', value_name = "DIR")]
    pub(super) include: Vec<PathBuf>,
}

impl SimArguments {
    /// Returns the arguments for the runs of a sweep: a scenario, folders of included files and `--seed`.
    pub(super) fn of_sweep(scenario: PathBuf, include: Vec<PathBuf>, seed: Option<u32>) -> Self {
        SimArguments {
            scenario,
            robot: None,
            count: None,
            seed,
            #[cfg(feature = "view")]
            view: false,
            #[cfg(feature = "view")]
            read_only: false,
            #[cfg(feature = "view")]
            no_browser: false,
            headless: false,
            json: false,
            checks: false,
            record: None,
            svg: None,
            data: None,
            runs: None,
            set: Vec::new(),
            threads: None,
            emulator: None,
            csv: None,
            resume: false,
            include,
        }
    }
}
