//! `bbz sweep`: many runs in a folder that any number of processes and computers fill.
//!
//! `plan` writes the list of runs, `run` carries out chunks of it, `status` counts them, `merge` writes
//! the table, and `report` draws it. An engine that schedules jobs calls `bbz sweep run` and needs to know nothing else.

mod cluster;
mod folder;
mod merge;
mod plan;
mod report;
mod run;
mod status;
#[cfg(feature = "view")]
mod view;

use clap::{Args, Subcommand};

use crate::exit::ExitStatus;
use crate::problem::Problem;

const EXAMPLES: &str = "\
Examples:
  bbz sweep plan study.toml --runs 30        list the runs of study.toml in the folder study.sweep
  bbz sweep run study.sweep                  carry them out on all cores
  bbz sweep run study.sweep --shard 1/2      one half; --shard 2/2 on another computer
  bbz sweep run study.sweep --chunk 7 --threads 1    one chunk, for an engine that schedules jobs
  bbz sweep status study.sweep               count what is finished
  for chunk in $(bbz sweep status study.sweep --missing); do bbz sweep run study.sweep --chunk $chunk; done    the same runs
  bbz sweep merge study.sweep -o study.csv   write the table
  bbz sweep report study.sweep -o study.html curves, maps of two parameters, and the runs at both ends of each measure
  bbz sweep report study.sweep --view        the same in the browser, where links open the runs
  bbz sweep view study.sweep 17              one run in the page
  bbz sweep submit study.sweep -- --time=01:00:00    all that is missing, as a job array of Slurm; `status` shows its tasks
  bbz sweep plan study.toml --runs 60        30 more runs of each point; finished runs are kept

Exit status: 0, or 1 a run could not go on, or (status) is missing, 2 a scenario or script is wrong, 3 wrong command line, file or
folder, 130 stopped by Ctrl-C or SIGTERM.";

/// Arguments of `bbz sweep`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct SweepArguments {
    #[command(subcommand)]
    command: SweepCommand,
}

#[derive(Debug, Subcommand)]
enum SweepCommand {
    /// List the runs of a scenario in a folder, or give that folder more runs
    Plan(plan::PlanArguments),
    /// Carry out the runs that are not finished
    Run(run::RunArguments),
    /// Count the runs that are finished
    Status(status::StatusArguments),
    /// Write the table of all runs
    Merge(merge::MergeArguments),
    /// Carry out the runs that are not finished by a job array of Slurm
    Submit(cluster::SubmitArguments),
    /// End the tasks of a job array of Slurm
    Cancel(cluster::CancelArguments),
    /// Write curves and maps of all runs as one HTML file
    Report(report::ReportArguments),
    /// Show a run in a page on this computer
    #[cfg(feature = "view")]
    View(view::ViewArguments),
}

/// Carries out the command.
pub fn execute(arguments: &SweepArguments) -> Result<ExitStatus, Box<dyn Problem>> {
    match &arguments.command {
        SweepCommand::Plan(arguments) => plan::execute(arguments),
        SweepCommand::Run(arguments) => run::execute(arguments),
        SweepCommand::Status(arguments) => status::execute(arguments),
        SweepCommand::Merge(arguments) => merge::execute(arguments),
        SweepCommand::Submit(arguments) => cluster::submit(arguments),
        SweepCommand::Cancel(arguments) => cluster::cancel(arguments),
        SweepCommand::Report(arguments) => report::execute(arguments),
        #[cfg(feature = "view")]
        SweepCommand::View(arguments) => view::execute(arguments),
    }
}
