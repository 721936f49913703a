//! Job arrays of Slurm that carry out a sweep.
//!
//! A submission is a folder next to that of the sweep: `study.slurm/1` for `study.sweep`. It has the script of
//! the job, the chunks of each task, the number of the job, and a log for each task. `submission` writes it,
//! `slurm` calls Slurm's programs, and `state` reads logs and the queue. Slurm schedules; nothing here does.

mod slurm;
mod state;
mod submission;

pub use state::state;

use std::path::{Path, PathBuf};

use clap::Args;

use crate::chunks::{self, StoreProblem};
use crate::exit::ExitStatus;
use crate::output;
use crate::problem::Problem;

use super::super::experiment;
use super::folder;
use submission::Submission;

/// A reason why a sweep cannot be submitted.
#[derive(Debug, thiserror::Error)]
enum SubmitError {
    /// Tasks of the last submission that have not ended.
    #[error("{count} tasks of job {job} have not ended")]
    HasTasks { job: String, count: usize, folder: PathBuf },
    /// A folder without a submission.
    #[error("`{0}` was not submitted")]
    NotSubmitted(PathBuf),
}

impl Problem for SubmitError {
    fn help(&self) -> Option<String> {
        Some(match self {
            SubmitError::HasTasks { folder, .. } => {
                let folder = folder.display();
                format!("wait for them, or end them with `bbz sweep cancel {folder}`")
            }
            SubmitError::NotSubmitted(folder) => {
                format!("`bbz sweep submit {}` does", folder.display())
            }
        })
    }
}

/// Arguments of `bbz sweep submit`.
#[derive(Debug, Args)]
pub struct SubmitArguments {
    /// Folder of `bbz sweep plan`
    folder: PathBuf,
    /// Number of tasks of the job array [default: one for each chunk, up to Slurm's limit]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    tasks: Option<u32>,
    /// Options of sbatch, such as `-- --time=01:00:00 --partition=short`
    #[arg(last = true, value_name = "OPTION")]
    options: Vec<String>,
}

/// Arguments of `bbz sweep cancel`.
#[derive(Debug, Args)]
pub struct CancelArguments {
    /// Folder of `bbz sweep submit`
    folder: PathBuf,
}

/// Carries out `bbz sweep submit`.
pub fn submit(arguments: &SubmitArguments) -> Result<ExitStatus, Box<dyn Problem>> {
    let store = folder::open(&arguments.folder)?;
    let plan = store.plan();
    experiment::check_program(plan, &store.path())?;
    let runs = experiment::runs(plan);
    let found = store.all(|run| runs.key(run)).map_err(StoreProblem)?;
    chunks::print_aside(&found.aside);
    let missing = folder::missing(plan, &found.outcomes);
    if missing.is_empty() {
        output::write("all runs are finished\n")?;
        return Ok(ExitStatus::Success);
    }
    let last = Submission::last(&arguments.folder)?;
    if let Some(Submission { job: Some(job), .. }) = &last {
        let count = slurm::queue(job)?.len();
        if count > 0 {
            let (job, folder) = (job.clone(), arguments.folder.clone());
            return Err(SubmitError::HasTasks { job, count, folder }.into());
        }
    }
    let most = slurm::tasks_max();
    let tasks = arguments.tasks.map_or(most, |tasks| tasks as usize).min(missing.len());
    let number = last.map_or(1, |last| last.number + 1);
    let submission = Submission::write(&arguments.folder, number, &missing, tasks)?;
    let job = slurm::submit(&submission.script(), &arguments.options)?;
    submission.keep_job(&job)?;
    let text = format!(
        "job {job} of Slurm: {} chunks in {tasks} tasks, with logs in {}\n",
        missing.len(),
        submission.folder.display()
    );
    output::write(&text)?;
    Ok(ExitStatus::Success)
}

/// Carries out `bbz sweep cancel`.
pub fn cancel(arguments: &CancelArguments) -> Result<ExitStatus, Box<dyn Problem>> {
    folder::open(&arguments.folder)?;
    let job = job_of(&arguments.folder)?;
    let count = slurm::queue(&job)?.len();
    if count > 0 {
        slurm::cancel(&job)?;
    }
    output::write(&format!("job {job} of Slurm: {count} tasks canceled\n"))?;
    Ok(ExitStatus::Success)
}

/// Returns the job of the last submission of a sweep.
fn job_of(folder: &Path) -> Result<String, Box<dyn Problem>> {
    let job = Submission::last(folder)?.and_then(|last| last.job);
    Ok(job.ok_or_else(|| SubmitError::NotSubmitted(folder.to_owned()))?)
}
