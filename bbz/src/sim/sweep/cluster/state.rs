//! The state of a submission: the queue of Slurm and the logs of the tasks.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use serde_json::{Value, json};

use crate::problem::Problem;
use crate::report;

use super::slurm::{self, Queued};
use super::submission::{BEGINS, ENDS, Submission};

/// Failed tasks whose logs are shown, and the lines of each.
const FAILED_MAX: usize = 5;
const LINES: usize = 3;

/// The reason why writing to a string succeeds.
const WRITTEN: &str = "a string accepts all text";

/// A task that has ended, and not well.
#[derive(Debug, Clone, PartialEq, Eq)]
struct FailedTask {
    number: usize,
    /// The status of its command; `None` if the task was killed.
    status: Option<i32>,
    log: PathBuf,
    /// The last lines of its log.
    lines: Vec<String>,
}

/// The state of a submission.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ClusterState {
    job: String,
    running: usize,
    waiting: usize,
    ended: usize,
    failed: Vec<FailedTask>,
    /// Seconds until the last chunk is finished, at the mean rate; `None` if it is not known.
    seconds_left: Option<u64>,
}

/// A log of a task.
#[derive(Debug, Default)]
struct Log {
    begin: Option<u64>,
    status: Option<i32>,
    lines: Vec<String>,
}

impl Log {
    fn read(path: &Path) -> Log {
        // A task that waits has no log.
        let bytes = fs::read(path).unwrap_or_default();
        let text = String::from_utf8_lossy(&bytes);
        let mut log = Log::default();
        for line in text.lines() {
            if let Some(time) = line.strip_prefix(BEGINS) {
                log.begin = time.trim().parse().ok();
            } else if let Some(status) = line.strip_prefix(ENDS) {
                log.status = status.trim().parse().ok();
            } else {
                log.lines.push(report::printable(line));
            }
        }
        log.lines = log.lines.split_off(log.lines.len().saturating_sub(LINES));
        log
    }
}

/// Returns the state of the last submission of a sweep; `None` if there is none, or if it is not known, about
/// which a warning is printed: the counts of runs are right all the same. `chunks` is the number of chunks
/// of the plan, and `missing` are those that are not finished.
pub fn state(sweep: &Path, chunks: usize, missing: &[usize]) -> Option<ClusterState> {
    known_state(sweep, chunks, missing).unwrap_or_else(|problem| {
        report::warning(&problem.to_string(), problem.help().as_deref());
        None
    })
}

fn known_state(
    sweep: &Path,
    chunks: usize,
    missing: &[usize],
) -> Result<Option<ClusterState>, Box<dyn Problem>> {
    let Some(submission) = Submission::last(sweep)? else { return Ok(None) };
    let Some(job) = submission.job.clone() else { return Ok(None) };
    let (tasks, chunks) = submission.tasks(chunks)?;
    let queue = slurm::queue(&job)?;
    let (ended, failed, begin) = ends(&submission, tasks, &queue);
    let count = |state: Queued| queue.values().filter(|queued| **queued == state).count();
    let missing: BTreeSet<&usize> = missing.iter().collect();
    let left = chunks.iter().filter(|chunk| missing.contains(chunk)).count();
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs();
    let elapsed = begin.map(|begin| now.saturating_sub(begin));
    let done = chunks.len() - left;
    let seconds_left = elapsed.filter(|_| done > 0 && !queue.is_empty());
    Ok(Some(ClusterState {
        job,
        running: count(Queued::Running),
        waiting: count(Queued::Waiting),
        ended,
        failed,
        seconds_left: seconds_left.map(|elapsed| elapsed * left as u64 / done as u64),
    }))
}

/// Returns the number of tasks that ended well, those that did not, and the time at which the first began.
fn ends(
    submission: &Submission,
    tasks: usize,
    queue: &BTreeMap<usize, Queued>,
) -> (usize, Vec<FailedTask>, Option<u64>) {
    let (mut ended, mut failed, mut begin) = (0, Vec::new(), None::<u64>);
    for number in 1..=tasks {
        let path = submission.log(number);
        let log = Log::read(&path);
        begin = begin.into_iter().chain(log.begin).min();
        match log.status {
            Some(0) => ended += 1,
            _ if queue.contains_key(&number) => {}
            status => failed.push(FailedTask { number, status, log: path, lines: log.lines }),
        }
    }
    (ended, failed, begin)
}

impl ClusterState {
    /// Describes the state for people.
    pub fn describe(&self) -> String {
        let ClusterState { job, running, waiting, ended, failed, seconds_left } = self;
        let mut text = format!(
            "job {job} of Slurm: {running} tasks run, {waiting} wait, {ended} have ended, {} failed\n",
            failed.len()
        );
        if let Some(seconds) = seconds_left {
            let [hours, minutes] = [seconds / 3600, seconds / 60 % 60];
            writeln!(text, "time left: about {hours}:{minutes:02}:{:02}", seconds % 60)
                .expect(WRITTEN);
        }
        for FailedTask { number, status, log, lines } in failed.iter().take(FAILED_MAX) {
            let end = match status {
                Some(status) => format!("ended with status {status}"),
                None => "was killed, or was canceled before it began".to_owned(),
            };
            writeln!(text, "task {number} {end}: {}", log.display()).expect(WRITTEN);
            for line in lines {
                writeln!(text, "    {line}").expect(WRITTEN);
            }
        }
        text
    }

    /// Returns the state for programs.
    pub fn to_json(&self) -> Value {
        let failed = self.failed.iter().map(|task| {
            json!({ "task": task.number, "status": task.status, "log": task.log.display().to_string() })
        });
        json!({
            "job": self.job,
            "running": self.running,
            "waiting": self.waiting,
            "ended": self.ended,
            "failed": failed.collect::<Vec<Value>>(),
            "seconds_left": self.seconds_left,
        })
    }
}
