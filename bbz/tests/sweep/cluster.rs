//! `bbz sweep submit`, `status` and `cancel` with programs of Slurm that do what its manual pages say.
//! `cargo xtask soak executors` has a node of Slurm itself.

use std::fs;
use std::process::Command;

use serde_json::Value;

use crate::support::{Folder, Outcome, finish};

use super::{folder, merged, succeeds};

/// Takes a script as sbatch does, and carries out its tasks that `limit` allows: sbatch(1) says that options
/// before the script's name go before those in it, and that `%a` is the number of the task.
const SBATCH: &str = r##"#!/bin/sh
echo "$@" > sbatch.words
for script; do :; done
log=$(sed -n 's/^#SBATCH --output=//p' "$script" | tr -d "'")
last=$(sed -n 's/^#SBATCH --array=1-//p' "$script")
task=1
while [ $task -le $last ] && [ $task -le $(cat limit) ]; do
  SLURM_ARRAY_TASK_ID=$task sh "$script" > "$(echo "$log" | sed "s/%a/$task/")" 2>&1
  task=$((task + 1))
done
echo "17;cluster"
"##;

const SQUEUE: &str = "#!/bin/sh\necho \"$@\" > squeue.words\n[ -s queue ] && exec cat queue\n\
    echo 'slurm_load_jobs error: Invalid job id specified' >&2\nexit 1\n";
const SCANCEL: &str = "#!/bin/sh\necho \"$@\" > scancel.words\n: > queue\n";
const SCONTROL: &str = "#!/bin/sh\necho 'MaxArraySize            = 4'\n";

/// Makes the programs of Slurm, of which sbatch carries out `limit` tasks.
fn slurm(folder: &Folder, limit: usize) {
    fs::create_dir(folder.path("bin")).unwrap();
    let programs =
        [("sbatch", SBATCH), ("squeue", SQUEUE), ("scancel", SCANCEL), ("scontrol", SCONTROL)];
    for (name, text) in programs {
        folder.program(&format!("bin/{name}"), text.as_bytes());
    }
    folder.write("limit", limit.to_string());
    folder.write("queue", "");
}

fn command(folder: &Folder, words: &[&str]) -> Command {
    let mut command = folder.command(words);
    let path = std::env::var("PATH").unwrap();
    command.env("PATH", format!("{}:{path}", folder.path("bin").display()));
    command
}

fn bbz(folder: &Folder, words: &[&str]) -> Outcome {
    finish(command(folder, words).spawn().unwrap())
}

fn text(folder: &Folder, name: &str) -> String {
    String::from_utf8(folder.read(name)).unwrap()
}

#[test]
fn a_job_array_carries_out_what_is_missing() {
    let folder = folder("cluster_runs");
    slurm(&folder, 100);
    succeeds(&folder, &["sweep", "plan", "s.toml", "--runs", "20", "--chunk", "2"]);
    succeeds(&folder, &["sweep", "run", "s.sweep", "--chunk", "4"]);
    let submitted = bbz(&folder, &["sweep", "submit", "s.sweep", "--", "--time=10", "-p", "short"]);
    assert_eq!((submitted.status, &*submitted.stderr), (Some(0), ""));
    // Slurm allows three tasks.
    assert!(submitted.stdout.starts_with("job 17 of Slurm: 9 chunks in 3 tasks"), "{submitted:?}");
    let words = text(&folder, "sbatch.words");
    assert!(words.starts_with("--parsable --time=10 -p short /"), "{words}");
    assert_eq!(
        text(&folder, "s.slurm/1/tasks"),
        "--chunk 0-2\n--chunk 3 --chunk 5-6\n--chunk 7-9\n"
    );
    let status = bbz(&folder, &["sweep", "status", "s.sweep"]);
    let line = "job 17 of Slurm: 0 tasks run, 0 wait, 3 have ended, 0 failed\n";
    assert!(status.stdout.ends_with(line) && status.status == Some(0), "{status:?}");
    succeeds(&folder, &["sim", "s.toml", "--runs", "20", "--csv", "whole.csv"]);
    assert_eq!(folder.read("whole.csv"), merged(&folder, "s.sweep").as_bytes());
    let again = bbz(&folder, &["sweep", "submit", "s.sweep"]);
    again.succeeds_with("all runs are finished\n");
}

#[test]
fn runs_are_counted_though_a_submission_is_damaged() {
    let folder = folder("cluster_damaged");
    slurm(&folder, 1);
    succeeds(&folder, &["sweep", "plan", "s.toml", "--runs", "8", "--chunk", "1"]);
    bbz(&folder, &["sweep", "submit", "s.sweep", "--tasks", "4"]);
    fs::remove_file(folder.path("s.slurm/1/tasks")).unwrap();
    let status = bbz(&folder, &["sweep", "status", "s.sweep"]);
    assert!(status.stdout.starts_with("2 of 8 runs are finished"), "{status:?}");
    assert!(status.stderr.contains("s.slurm/1/tasks"), "{status:?}");
}

#[test]
fn the_state_of_tasks_is_shown_and_the_rest_is_submitted_again() {
    let folder = folder("cluster_state");
    slurm(&folder, 1);
    succeeds(&folder, &["sweep", "plan", "s.toml", "--runs", "8", "--chunk", "1"]);
    bbz(&folder, &["sweep", "submit", "s.sweep", "--tasks", "4"]);
    // Of the tasks that did not begin, one runs, one waits, and one was killed.
    folder.write("queue", "2 RUNNING\n4 PENDING\n");
    folder.write(
        "s.slurm/1/3.log",
        "bbz: the task begins at 100\nslurmstepd: error: *** TIME LIMIT\n",
    );
    let status = bbz(&folder, &["sweep", "status", "s.sweep"]);
    for part in [
        "2 of 8 runs are finished",
        "job 17 of Slurm: 1 tasks run, 1 wait, 1 have ended, 1 failed\n",
        "time left: about ",
        "task 3 was killed, or was canceled before it began: ",
        ": s.slurm/1/3.log\n    slurmstepd: error: *** TIME LIMIT\n",
    ] {
        assert!(status.stdout.contains(part), "{part}: {status:?}");
    }
    assert_eq!(text(&folder, "squeue.words").trim(), "--noheader --array --format=%K %T --jobs 17");
    let json = bbz(&folder, &["sweep", "status", "s.sweep", "--json"]);
    let json: Value = serde_json::from_str(&json.stdout).unwrap();
    assert_eq!((&json["slurm"]["job"], &json["slurm"]["running"]), (&"17".into(), &1.into()));
    assert_eq!(json["slurm"]["failed"][0]["task"], 3);
    let busy = bbz(&folder, &["sweep", "submit", "s.sweep"]);
    busy.fails_with(3, &["2 tasks of job 17 have not ended", "bbz sweep cancel s.sweep"]);
    let canceled = bbz(&folder, &["sweep", "cancel", "s.sweep"]);
    canceled.succeeds_with("job 17 of Slurm: 2 tasks canceled\n");
    assert_eq!(text(&folder, "scancel.words"), "17\n");
    folder.write("limit", "100");
    let again = bbz(&folder, &["sweep", "submit", "s.sweep"]);
    assert!(again.stdout.starts_with("job 17 of Slurm: 6 chunks in 3 tasks"), "{again:?}");
    assert!(folder.path("s.slurm/2/job.sh").is_file());
    assert_eq!(bbz(&folder, &["sweep", "status", "s.sweep"]).status, Some(0));
}

/// A task that gets SIGTERM before its time is over ends `bbz`, which keeps the runs of its chunk.
#[test]
fn a_task_that_is_told_to_end_keeps_its_runs() {
    let folder = folder("cluster_signal");
    slurm(&folder, 0);
    folder.write("s.toml", text(&folder, "s.toml").replace("duration = 5", "duration = 300"));
    succeeds(&folder, &["sweep", "plan", "s.toml", "--runs", "4000", "--chunk", "4000"]);
    bbz(&folder, &["sweep", "submit", "s.sweep"]);
    let log = fs::File::create(folder.path("s.slurm/1/1.log")).unwrap();
    let mut task = Command::new("sh");
    task.arg(folder.path("s.slurm/1/job.sh")).env("SLURM_ARRAY_TASK_ID", "1").stdout(log);
    let mut task = task.spawn().unwrap();
    // Rows are written after some seconds.
    let has_rows = || folder.path("s.sweep").read_dir().unwrap().count() > 1;
    super::wait_until(has_rows);
    Command::new("kill").args(["-TERM", &task.id().to_string()]).status().unwrap();
    assert_eq!(task.wait().unwrap().code(), Some(130));
    let log = text(&folder, "s.slurm/1/1.log");
    assert!(log.ends_with("bbz: the task ends with status 130\n"), "{log}");
    let status = bbz(&folder, &["sweep", "status", "s.sweep"]);
    assert!(status.stdout.contains("task 1 ended with status 130"), "{status:?}");
    assert!(!status.stdout.starts_with("0 of"), "{status:?}");
}

#[test]
fn without_slurm_the_error_says_what_to_do() {
    let folder = folder("cluster_none");
    succeeds(&folder, &["sweep", "plan", "s.toml", "--runs", "2"]);
    let mut command = folder.command(&["sweep", "submit", "s.sweep"]);
    let outcome = finish(command.env("PATH", "").spawn().unwrap());
    outcome.fails_with(3, &["cannot start `sbatch`", "bbz sweep run"]);
    // Without a job, there is nothing to cancel.
    folder.bbz(&["sweep", "cancel", "s.sweep"]).fails_with(3, &["was not submitted"]);
    fs::create_dir_all(folder.path("bin")).unwrap();
    folder
        .program("bin/sbatch", b"#!/bin/sh\necho 'sbatch: error: invalid partition' >&2\nexit 1\n");
    let refused =
        finish(super::cluster::command(&folder, &["sweep", "submit", "s.sweep"]).spawn().unwrap());
    refused.fails_with(3, &["`sbatch` failed: sbatch: error: invalid partition"]);
    let status = folder.bbz(&["sweep", "status", "s.sweep"]);
    assert!(!status.stdout.contains("Slurm"), "{status:?}");
}
