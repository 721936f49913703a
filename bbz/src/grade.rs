//! `bbz grade`: runs the results of an assignment again.

use std::fs;
use std::path::{Path, PathBuf};

use bittybuzz_live::{Assignment, Defect, Graded, Mark, Results, marks_csv};
use bittybuzz_toml_reader::file;
use serde_json::{Value, json};

use crate::escape::escaped;
use crate::exit::ExitStatus;
use crate::file_error::FileError;
use crate::output::ScriptOutput;
use crate::problem::Problem;
use crate::report::{self, printable};
use crate::sim::desk::Desk;
use crate::sim::summary::later;
use crate::whole_file::{self, Inputs};

/// A reason why a folder cannot be graded.
#[derive(Debug, thiserror::Error)]
enum GradeError {
    /// The folder has no scenario, or several.
    #[error("`{0}` does not have one scenario (*.toml)")]
    WhichAssignment(PathBuf),
    /// The folder has no results.
    #[error("`{0}` has no results (*.json)")]
    NothingHandedIn(PathBuf),
    /// The assignment does not run: the mistakes of its scenario and scripts.
    #[error("the assignment does not run: {}", .0.trim_end())]
    Assignment(String),
}

impl Problem for GradeError {
    fn help(&self) -> Option<String> {
        match self {
            GradeError::WhichAssignment(_) => Some("name it with `--scenario FILE`".to_owned()),
            GradeError::NothingHandedIn(_) => {
                Some("the page of an assignment writes them by `Hand in`".to_owned())
            }
            GradeError::Assignment(_) => None,
        }
    }
}

/// The most bytes of a file that is graded, which contains a scenario and scripts.
const BYTES_MAX: u64 = 16 * 1024 * 1024;

const EXAMPLES: &str = "\
Examples:
  bbz grade results                              all results (*.json) in the only scenario (*.toml) there
  bbz grade results --scenario hops.toml         the assignment is elsewhere
  bbz grade results --json                       for programs that read the result
  bbz grade results --csv marks.csv              a table, for a spreadsheet

The page of an assignment writes the files (*.json). Their scripts run in the scenario of the teacher, whatever
scenario they were handed in with. The verdicts are those of this run, not those of the files.

Exit status: 0 all results are those of the files, 1 one is not or does not run, 3 wrong command line or file.";

#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct GradeArguments {
    /// Folder with results that were handed in (*.json)
    folder: PathBuf,
    /// Scenario of the assignment [default: the only *.toml file of the folder]
    #[arg(long, value_name = "FILE")]
    scenario: Option<PathBuf>,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
    /// Also write a table of the marks: a line for each file, a column for each expectation
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Folder to search for included files; may be given several times
    #[arg(short = 'I', value_name = "DIR")]
    include: Vec<PathBuf>,
}

/// Carries out the command.
pub fn execute(arguments: &GradeArguments) -> Result<ExitStatus, Box<dyn Problem>> {
    let scenario = match &arguments.scenario {
        Some(scenario) => scenario.clone(),
        None => only_scenario(&arguments.folder)?,
    };
    let text = file::read_text(&scenario, file::TEXT_BYTES_MAX)
        .map_err(|error| FileError::reading(&scenario, error))?;
    let desk = Desk::for_scripts_of_others(&scenario, &arguments.include);
    // A mistake of the assignment is reported once, and not for each result.
    let assignment = Assignment::new(&desk, &text).map_err(GradeError::Assignment)?;
    let files = files(&arguments.folder, "json")?;
    if files.is_empty() {
        return Err(GradeError::NothingHandedIn(arguments.folder.clone()).into());
    }
    if let Some(table) = &arguments.csv {
        let mut inputs = Inputs::default();
        let read = files.iter().map(PathBuf::as_path).chain([scenario.as_path()]);
        read.chain(assignment.files()).for_each(|path| inputs.add(path));
        inputs.refuse(table)?;
    }
    let mut results = Results::default();
    for path in &files {
        // A script that reveals a defect does not keep the others from being graded.
        let result = Defect::catch(|| grade(path, &assignment));
        let result = result.unwrap_or_else(|defect| Err(defect.to_string()));
        results.add(name(path), result);
    }
    let marks = results.marks();
    if let Some(table) = &arguments.csv {
        whole_file::write(table, escaped(&marks_csv(&marks)).as_bytes())?;
    }
    let mut output = ScriptOutput::new();
    if arguments.json {
        let all: Vec<Value> = marks.iter().map(object).collect();
        output.line(json!({ "results": all }).to_string().as_bytes());
    } else {
        for mark in &marks {
            lines(mark).iter().for_each(|line| output.line(line.as_bytes()));
        }
    }
    output.finish()?;
    let agrees = |mark: &&Mark| mark.ran.as_ref().is_some_and(|ran| ran.as_handed_in);
    let wrong = marks.len() - marks.iter().filter(agrees).count();
    if wrong == 0 {
        return Ok(ExitStatus::Success);
    }
    let text = format!("{wrong} of {} results differ from their files or do not run", marks.len());
    report::warning(&text, None);
    Ok(ExitStatus::RuntimeError)
}

/// Returns the only scenario of a folder; fails if there is none or several.
fn only_scenario(folder: &Path) -> Result<PathBuf, Box<dyn Problem>> {
    let mut found = files(folder, "toml")?;
    match (found.pop(), found.is_empty()) {
        (Some(only), true) => Ok(only),
        _ => Err(GradeError::WhichAssignment(folder.to_owned()).into()),
    }
}

/// Returns the files of a folder with that extension, sorted by name.
fn files(folder: &Path, ending: &str) -> Result<Vec<PathBuf>, FileError> {
    let unreadable = |error| FileError::reading(folder, error);
    let entries = fs::read_dir(folder).map_err(unreadable)?;
    let paths = entries.map(|entry| entry.map(|entry| entry.path()));
    let mut paths: Vec<PathBuf> = paths.collect::<Result<_, _>>().map_err(unreadable)?;
    paths.retain(|path| path.extension().is_some_and(|other| other == ending));
    paths.sort();
    Ok(paths)
}

/// Runs the scripts of a file. The error is a sentence for people.
fn grade(path: &Path, assignment: &Assignment<'_>) -> Result<Graded, String> {
    let content = file::read_text(path, BYTES_MAX).map_err(|error| error.to_string())?;
    assignment.prepare(&content)?.run()
}

fn name(path: &Path) -> String {
    let name = path.file_name().expect("it is an entry of a folder");
    name.to_string_lossy().into_owned()
}

/// Returns a mark as lines for people.
fn lines(Mark { file, reason, ran, .. }: &Mark) -> Vec<String> {
    let file = printable(file);
    let Some(ran) = ran else {
        let reason = reason.as_deref().unwrap_or_default();
        let reason = reason.trim_end().lines().map(|line| format!("    {}", printable(line)));
        return [format!("{file}: does not run")].into_iter().chain(reason).collect();
    };
    let (held, count) = (ran.held(), ran.expectations.len());
    let mut lines = vec![format!("{file}: {}: {held} of {count} held", printable(&ran.by))];
    for one in &ran.expectations {
        let name = one.name.as_ref().map_or(String::new(), |name| format!("{name}: "));
        let verdict = if one.held { "held  " } else { "FAILED" };
        let since = match (one.held_at, one.since) {
            (Some(held), Some(since)) if held < since => format!("; {}", later(held, since)),
            (Some(_), Some(since)) => format!("; since {since:.1} s"),
            _ => String::new(),
        };
        lines.push(format!("    {verdict}  {name}{}{since}", one.text));
    }
    if !ran.success && held == count {
        lines.push("    FAILED  a script had an error".to_owned());
    }
    lines.extend(reason.iter().map(|reason| format!("    note: {}", printable(reason))));
    if !ran.same_scripts.is_empty() {
        let same = printable(&ran.same_scripts.join(", "));
        lines.push(format!("    note: the same scripts as {same}"));
    }
    lines
}

/// Returns a mark as JSON.
fn object(Mark { file, runs, reason, ran }: &Mark) -> Value {
    match ran {
        None => json!({ "file": file, "runs": runs, "reason": reason }),
        Some(ran) => json!({
            "file": file,
            "by": ran.by,
            "runs": runs,
            "success": ran.success,
            "expectations": ran.expectations,
            "digest": ran.digest,
            "as_handed_in": ran.as_handed_in,
            "reason": reason,
            "same_scripts": ran.same_scripts,
        }),
    }
}
