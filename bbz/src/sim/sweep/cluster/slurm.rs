//! Slurm's programs: sbatch, squeue, scancel and scontrol, as their manual pages describe them.

use std::collections::BTreeMap;
use std::io;
use std::path::Path;
use std::process::{Command, Output};

use crate::problem::Problem;

/// The most tasks of a job array if Slurm does not say it: its default `MaxArraySize` is 1001, and the
/// numbers of tasks stay below (slurm.conf(5)).
const TASKS_MAX: usize = 1000;

/// The words of Slurm for a job that has ended and is no longer known.
const UNKNOWN_JOB: &str = "Invalid job id";

/// A reason why a program of Slurm does not do its work.
#[derive(Debug, thiserror::Error)]
pub enum SlurmError {
    #[error("cannot start `{program}`: {error}")]
    NotStarted { program: &'static str, error: io::Error },
    #[error("`{program}` failed: {text}")]
    Failed { program: &'static str, text: String },
    #[error("`sbatch` printed `{0}` in place of the number of a job")]
    NoJob(String),
}

impl Problem for SlurmError {
    fn help(&self) -> Option<String> {
        match self {
            SlurmError::NotStarted { .. } => Some(
                "use a computer of a cluster with Slurm; on others, `bbz sweep run` carries out the sweep"
                    .to_owned(),
            ),
            SlurmError::Failed { .. } | SlurmError::NoJob(_) => None,
        }
    }
}

/// The state of a task in the queue.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Queued {
    Running,
    Waiting,
}

/// Submits a script with options. Returns the number of the job.
pub fn submit(script: &Path, options: &[String]) -> Result<String, SlurmError> {
    let mut command = Command::new("sbatch");
    command.arg("--parsable").args(options).arg(script);
    let text = printed("sbatch", &mut command)?;
    // sbatch(1): "the job id number and the cluster name if present", with a semicolon between them.
    let job = text.trim().split(';').next().unwrap_or_default();
    match !job.is_empty() && job.bytes().all(|byte| byte.is_ascii_digit()) {
        true => Ok(job.to_owned()),
        false => Err(SlurmError::NoJob(text.trim().to_owned())),
    }
}

/// Returns the tasks of a job that have not ended, by their numbers.
pub fn queue(job: &str) -> Result<BTreeMap<usize, Queued>, SlurmError> {
    let mut command = Command::new("squeue");
    command.args(["--noheader", "--array", "--format=%K %T", "--jobs", job]);
    let text = match printed("squeue", &mut command) {
        Err(SlurmError::Failed { text, .. }) if text.contains(UNKNOWN_JOB) => String::new(),
        other => other?,
    };
    Ok(text.lines().filter_map(task).collect())
}

/// Returns the number and the state of a task from a line of squeue. States of tasks that have ended stay
/// in the queue for some minutes.
fn task(line: &str) -> Option<(usize, Queued)> {
    let (number, state) = line.trim().split_once(' ')?;
    let state = match state.trim() {
        "RUNNING" | "COMPLETING" | "SUSPENDED" | "STOPPED" | "SIGNALING" | "STAGE_OUT" => {
            Queued::Running
        }
        "PENDING" | "CONFIGURING" | "REQUEUED" | "REQUEUE_HOLD" | "REQUEUE_FED"
        | "SPECIAL_EXIT" | "RESV_DEL_HOLD" | "RESIZING" => Queued::Waiting,
        _ => return None,
    };
    Some((number.parse().ok()?, state))
}

/// Ends all tasks of a job.
pub fn cancel(job: &str) -> Result<(), SlurmError> {
    printed("scancel", Command::new("scancel").arg(job)).map(drop)
}

/// Returns the most tasks of a job array.
pub fn tasks_max() -> usize {
    let config = printed("scontrol", Command::new("scontrol").args(["show", "config"]));
    let config = config.unwrap_or_default();
    let size = config.lines().find_map(|line| line.strip_prefix("MaxArraySize"));
    let size = size.and_then(|line| line.trim_start_matches([' ', '=']).trim().parse().ok());
    size.map_or(TASKS_MAX, |size: usize| size.saturating_sub(1).max(1))
}

/// Carries out a program. Returns its output.
fn printed(program: &'static str, command: &mut Command) -> Result<String, SlurmError> {
    let Output { status, stdout, stderr } =
        command.output().map_err(|error| SlurmError::NotStarted { program, error })?;
    if status.success() {
        return Ok(String::from_utf8_lossy(&stdout).into_owned());
    }
    let text = String::from_utf8_lossy(&stderr);
    let text = text.trim().lines().collect::<Vec<&str>>().join("; ");
    Err(SlurmError::Failed {
        program,
        text: if text.is_empty() { status.to_string() } else { text },
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The lines are those of squeue 22.05.8.
    #[test]
    fn tasks_that_have_ended_are_not_in_the_queue() {
        let lines =
            ["3 RUNNING", "12 PENDING", "4 COMPLETING", "5 COMPLETED", "6 TIMEOUT", "7 FAILED", ""];
        let tasks: Vec<_> = lines.iter().filter_map(|line| task(line)).collect();
        let expected = [(3, Queued::Running), (12, Queued::Waiting), (4, Queued::Running)];
        assert_eq!(tasks, expected);
    }
}
