//! The folder of a submission: script, chunks of each task, job, and logs.

use std::fs;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use crate::file_error::FileError;
use crate::launch;
use crate::problem::Problem;
use crate::shell;
use crate::whole_file;

/// Names in the folder of a submission.
const SCRIPT: &str = "job.sh";
const TASKS: &str = "tasks";
const JOB: &str = "job";

/// The first words of the lines that a task writes at its beginning and at its end.
pub const BEGINS: &str = "bbz: the task begins at ";
pub const ENDS: &str = "bbz: the task ends with status ";

/// A submission of a sweep.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Submission {
    /// From 1.
    pub number: u32,
    pub folder: PathBuf,
    /// The job; `None` if Slurm did not take it.
    pub job: Option<String>,
}

impl Submission {
    /// Returns the last submission of a sweep; `None` if there is none.
    pub fn last(sweep: &Path) -> Result<Option<Submission>, FileError> {
        let folder = beside(sweep);
        if !folder.is_dir() {
            return Ok(None);
        }
        let unreadable = |error| FileError::reading(&folder, error);
        let mut last = None;
        for entry in fs::read_dir(&folder).map_err(unreadable)? {
            let name = entry.map_err(unreadable)?.file_name();
            let number = name.to_str().and_then(|name| name.parse::<u32>().ok());
            // A folder of another program has no number after it.
            last = last.max(number.filter(|number| *number < u32::MAX));
        }
        let of_number = |number: u32| {
            let folder = folder.join(number.to_string());
            let job = fs::read_to_string(folder.join(JOB)).ok().map(|job| job.trim().to_owned());
            Submission { number, folder, job: job.filter(|job| !job.is_empty()) }
        };
        Ok(last.map(of_number))
    }

    /// Writes the script and the chunks of the tasks of a sweep.
    pub fn write(
        sweep: &Path,
        number: u32,
        chunks: &[usize],
        tasks: usize,
    ) -> Result<Submission, Box<dyn Problem>> {
        let folder = beside(sweep).join(number.to_string());
        let unwritable = |error| FileError::writing(&folder, error);
        fs::create_dir_all(&folder).map_err(unwritable)?;
        // A task starts in a folder of Slurm's choice.
        let absolute =
            |path: &Path| fs::canonicalize(path).map_err(|error| FileError::reading(path, error));
        let folder = absolute(&folder)?;
        let text = script(&folder, &launch::from_anywhere(), &absolute(sweep)?);
        let share = |task: usize| {
            let [from, to] = [task, task + 1].map(|task| task * chunks.len() / tasks);
            options(&chunks[from..to]) + "\n"
        };
        let shares: String = (0..tasks).map(share).collect();
        whole_file::write(&folder.join(TASKS), shares.as_bytes())?;
        let script = text.replace("@TASKS", &tasks.to_string());
        whole_file::write(&folder.join(SCRIPT), script.as_bytes())?;
        Ok(Submission { number, folder, job: None })
    }

    /// Returns the path of the script.
    pub fn script(&self) -> PathBuf {
        self.folder.join(SCRIPT)
    }

    /// Keeps the number of the job.
    pub fn keep_job(&self, job: &str) -> Result<(), FileError> {
        whole_file::write(&self.folder.join(JOB), format!("{job}\n").as_bytes())
    }

    /// Returns the number of tasks, and the chunks of a plan with `chunks` chunks that they carry out. A
    /// later plan may have fewer.
    pub fn tasks(&self, chunks: usize) -> Result<(usize, Vec<usize>), FileError> {
        let path = self.folder.join(TASKS);
        let text = fs::read_to_string(&path).map_err(|error| FileError::reading(&path, error))?;
        let ranges = text.split_whitespace().filter(|word| *word != "--chunk");
        let ranges: Vec<RangeInclusive<usize>> = ranges.filter_map(range).collect();
        let is_in = |chunk: &usize| ranges.iter().any(|range| range.contains(chunk));
        Ok((text.lines().count(), (0..chunks).filter(is_in).collect()))
    }

    /// Returns the path of the log of a task.
    pub fn log(&self, task: usize) -> PathBuf {
        self.folder.join(format!("{task}.log"))
    }
}

/// Returns the folder of the submissions of a sweep.
fn beside(sweep: &Path) -> PathBuf {
    // `.` and `..` have no name of their own.
    let sweep = match sweep.file_name() {
        Some(_) => sweep.to_owned(),
        None => fs::canonicalize(sweep).unwrap_or_else(|_| sweep.to_owned()),
    };
    match sweep.extension() {
        Some(end) if end == "sweep" => sweep.with_extension("slurm"),
        _ => whole_file::with_suffix(&sweep, ".slurm"),
    }
}

/// Returns the chunks of a word such as `3` or `3-7`.
fn range(word: &str) -> Option<RangeInclusive<usize>> {
    let (first, last) = word.split_once('-').unwrap_or((word, word));
    Some(first.parse().ok()?..=last.parse().ok()?)
}

/// Returns the options of `bbz sweep run` for some chunks, with successive ones as ranges.
fn options(chunks: &[usize]) -> String {
    let ranges = chunks.chunk_by(|one, next| one + 1 == *next);
    let option = |range: &[usize]| match range {
        [one] => format!("--chunk {one}"),
        [from, .., to] => format!("--chunk {from}-{to}"),
        [] => String::new(),
    };
    ranges.map(option).collect::<Vec<String>>().join(" ")
}

/// Returns the script of the tasks, which start `program`, with `@TASKS` for their number. Thirty seconds before the time of a
/// task is over, it gets SIGTERM, after which `bbz` keeps the finished runs of a chunk.
fn script(folder: &Path, program: &str, sweep: &Path) -> String {
    let name = sweep.file_stem().unwrap_or_default().to_string_lossy();
    let job: String =
        name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    let quoted = |path: &Path| shell::quoted(path.as_os_str());
    let [tasks, sweep] = [&*folder.join(TASKS), sweep].map(quoted);
    // sbatch(1): %a is the number of the task, and %% a percent sign.
    let log = folder.display().to_string().replace('%', "%%") + "/%a.log";
    let log = quoted(Path::new(&log));
    format!(
        "#!/bin/sh\n\
         # Carries out chunks of a sweep. `bbz sweep submit` has written this.\n\
         #SBATCH --job-name={job}\n\
         #SBATCH --array=1-@TASKS\n\
         #SBATCH --output={log}\n\
         #SBATCH --signal=B:TERM@30\n\
         echo \"{BEGINS}$(date +%s)\"\n\
         chunks=$(sed -n \"${{SLURM_ARRAY_TASK_ID}}p\" {tasks})\n\
         trap 'kill -TERM \"$child\"' TERM\n\
         {program} sweep run {sweep} --headless --threads \"${{SLURM_CPUS_PER_TASK:-1}}\" $chunks &\n\
         child=$!\n\
         wait \"$child\"\n\
         status=$?\n\
         # SIGTERM ends the wait before the command has ended.\n\
         while kill -0 \"$child\" 2>/dev/null; do\n\
         \x20 wait \"$child\"\n\
         \x20 status=$?\n\
         done\n\
         echo \"{ENDS}$status\"\n\
         exit \"$status\"\n"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn successive_chunks_are_ranges() {
        assert_eq!(options(&[3, 4, 5, 8, 10, 11]), "--chunk 3-5 --chunk 8 --chunk 10-11");
    }

    #[test]
    fn tasks_have_all_chunks_once() {
        let folder = tempfile::tempdir().unwrap();
        let sweep = folder.path().join("a study.sweep");
        fs::create_dir(&sweep).unwrap();
        let chunks: Vec<usize> = (0..40).filter(|chunk| chunk % 7 != 3).collect();
        for tasks in [1, 6, chunks.len()] {
            let submission = Submission::write(&sweep, 2, &chunks, tasks).unwrap();
            assert_eq!(submission.tasks(40).unwrap(), (tasks, chunks.clone()));
            let script = fs::read_to_string(submission.script()).unwrap();
            assert!(script.contains(&format!("--array=1-{tasks}\n")), "{script}");
        }
        assert_eq!(Submission::last(&sweep).unwrap().unwrap().job, None);
    }

    #[test]
    fn a_folder_with_the_largest_number_is_none_of_ours() {
        let folder = tempfile::tempdir().unwrap();
        let sweep = folder.path().join("s.sweep");
        fs::create_dir_all(folder.path().join("s.slurm/4294967295")).unwrap();
        assert_eq!(Submission::last(&sweep).unwrap(), None);
        Submission::write(&sweep, 7, &[0], 1).unwrap_err();
        fs::create_dir(&sweep).unwrap();
        Submission::write(&sweep, 7, &[0], 1).unwrap();
        assert_eq!(Submission::last(&sweep).unwrap().unwrap().number, 7);
    }

    #[test]
    fn damaged_tasks_are_no_chunks() {
        let folder = tempfile::tempdir().unwrap();
        let sweep = folder.path().join("s.sweep");
        fs::create_dir(&sweep).unwrap();
        let submission = Submission::write(&sweep, 1, &[0], 1).unwrap();
        let text = "--chunk 0-18446744073709551615\n--chunk 5-2 x 7- -\n";
        fs::write(submission.folder.join(TASKS), text).unwrap();
        assert_eq!(submission.tasks(3).unwrap(), (2, vec![0, 1, 2]));
    }

    #[test]
    fn the_folder_stands_next_to_the_sweep() {
        let folder = |sweep: &str| beside(Path::new(sweep)).display().to_string();
        assert_eq!(folder("a/study.sweep"), "a/study.slurm");
        assert_eq!(folder("a/study.sweep/"), "a/study.slurm");
        assert_eq!(folder("t.1"), "t.1.slurm");
    }
}
