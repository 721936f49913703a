//! `bbz grade`: runs the results of an assignment again.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use bittybuzz_arena::run::Simulation;
use bittybuzz_live::{CompilerMessage, Defect, HandIn, TextFile, set_up, text_of};
use bittybuzz_toml_reader::file;
use serde_json::{Value, json};

use crate::exit::ExitStatus;
use crate::file_error::FileError;
use crate::output::ScriptOutput;
use crate::problem::Problem;
use crate::report::{self, printable};
use crate::sim::desk::Desk;
use crate::sim::summary::later;

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

/// The most errors of a result that are listed.
const ERRORS_MAX: usize = 5;

const EXAMPLES: &str = "\
Examples:
  bbz grade results                              all results (*.json) in the only scenario (*.toml) there
  bbz grade results --scenario hops.toml         the assignment is elsewhere
  bbz grade results --json                       for programs that read the result

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
    /// Folder to search for included files; may be given several times
    #[arg(short = 'I', value_name = "DIR")]
    include: Vec<PathBuf>,
}

/// The grade of a file.
enum Grade {
    /// The scripts of the file ran again.
    Ran {
        /// The content of the file.
        handed_in: Box<HandIn>,
        /// The scripts of the file, with the results of this run.
        here: Box<HandIn>,
        /// The reason why the results differ from those of the file, if they do.
        differs: Option<String>,
    },
    /// The reason why the file cannot be read, or why its scripts do not run.
    Failed(String),
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
    set_up(&desk, &text, &[], &[]).map_err(|errors| GradeError::Assignment(text_of(&errors)))?;
    let files = files(&arguments.folder, "json")?;
    if files.is_empty() {
        return Err(GradeError::NothingHandedIn(arguments.folder.clone()).into());
    }
    let grades: Vec<(PathBuf, Grade)> = files
        .into_iter()
        .map(|path| {
            // A script that reveals a defect does not keep the others from being graded.
            let grade = Defect::catch(|| grade(&path, &desk, &scenario, &text));
            let grade = grade.unwrap_or_else(|defect| Err(defect.to_string()));
            (path, grade.unwrap_or_else(Grade::Failed))
        })
        .collect();
    let twins = twins(&grades);
    let mut output = ScriptOutput::new();
    if arguments.json {
        let all: Vec<Value> =
            grades.iter().map(|(path, grade)| object(path, grade, &twins)).collect();
        output.line(json!({ "results": all }).to_string().as_bytes());
    } else {
        for (path, grade) in &grades {
            lines(path, grade, &twins).iter().for_each(|line| output.line(line.as_bytes()));
        }
    }
    output.finish()?;
    let agrees = |(_, grade): &(PathBuf, Grade)| matches!(grade, Grade::Ran { differs: None, .. });
    let wrong = grades.iter().filter(|one| !agrees(one)).count();
    if wrong == 0 {
        return Ok(ExitStatus::Success);
    }
    let text = format!("{wrong} of {} results differ from their files or do not run", grades.len());
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
fn grade(path: &Path, desk: &Desk, scenario: &Path, text: &str) -> Result<Grade, String> {
    let content = file::read_text(path, BYTES_MAX).map_err(|error| error.to_string())?;
    let handed_in = HandIn::read(&content)
        .map_err(|error| format!("it is no result of an assignment: {error}"))?;
    if handed_in.scripts.is_empty() {
        return Err("it has no script".to_owned());
    }
    let mut names = BTreeSet::new();
    if let Some(TextFile { name, .. }) =
        handed_in.scripts.iter().find(|script| !names.insert(&script.name))
    {
        return Err(format!("it has the script `{name}` twice"));
    }
    let changed = handed_in.scripts.iter().find(|script| !script.is_whole());
    if let Some(TextFile { name, .. }) = changed {
        return Err(format!("its script `{name}` was changed after it was handed in"));
    }
    let folder = scenario.parent().expect("a path of a file that was read has a name");
    let scripts =
        handed_in.scripts.iter().map(|script| (folder.join(&script.name), script.text.clone()));
    let scripts: Vec<(PathBuf, String)> = scripts.collect();
    let setup = set_up(desk, text, &[], &scripts).map_err(|errors| first(&errors))?;
    let own: Vec<&Path> = setup.scenario.scripts().map(|(_, script)| script).collect();
    if let Some((other, _)) = scripts.iter().find(|(path, _)| !own.contains(&path.as_path())) {
        return Err(format!("no robot of the assignment has the script `{}`", other.display()));
    }
    let seed = setup.scenario.world.seed;
    let mut run = Simulation::new(Arc::new(setup), seed, 0).map_err(|error| error.to_string())?;
    while !run.is_over() {
        run.tick().map_err(|error| error.to_string())?;
        run.take_log();
    }
    let mut here = handed_in.clone();
    here.complete(&mut run);
    let lines = |text: &str| text.lines().map(str::to_owned).collect::<Vec<String>>();
    let differs = if lines(&handed_in.scenario.text) != lines(text) {
        Some("it was handed in with another scenario".to_owned())
    } else if handed_in.digest != here.digest {
        let version =
            (handed_in.bittybuzz != env!("CARGO_PKG_VERSION")).then_some(&handed_in.bittybuzz);
        let reason = version.map_or_else(String::new, |version| format!(", by version {version}"));
        Some(format!("it went another way where it was handed in{reason}"))
    } else {
        None
    };
    Ok(Grade::Ran { handed_in: Box::new(handed_in), here: Box::new(here), differs })
}

/// Returns the first errors as text, and the number of the others.
fn first(errors: &[CompilerMessage]) -> String {
    let listed = errors.len().min(ERRORS_MAX);
    let text = text_of(&errors[..listed]);
    match errors.len() - listed {
        0 => text,
        more => format!("{text}and {more} more\n"),
    }
}

/// Returns the files of each set of scripts that was handed in more than once.
fn twins(grades: &[(PathBuf, Grade)]) -> BTreeMap<Vec<&str>, Vec<&Path>> {
    let mut twins: BTreeMap<Vec<&str>, Vec<&Path>> = BTreeMap::new();
    for (path, grade) in grades {
        if let Grade::Ran { handed_in, .. } = grade {
            twins.entry(hashes(handed_in)).or_default().push(path);
        }
    }
    twins.retain(|_, files| files.len() > 1);
    twins
}

fn hashes(handed_in: &HandIn) -> Vec<&str> {
    handed_in.scripts.iter().map(|script| script.sha256.as_str()).collect()
}

/// Returns the other files with the same scripts.
fn others<'a>(
    path: &Path,
    handed_in: &HandIn,
    twins: &BTreeMap<Vec<&str>, Vec<&'a Path>>,
) -> Vec<&'a Path> {
    let same = twins.get(&hashes(handed_in)).into_iter().flatten().copied();
    same.filter(|other| *other != path).collect()
}

fn name(path: &Path) -> String {
    let name = path.file_name().expect("it is an entry of a folder");
    name.to_string_lossy().into_owned()
}

fn lines(path: &Path, grade: &Grade, twins: &BTreeMap<Vec<&str>, Vec<&Path>>) -> Vec<String> {
    let file = printable(&name(path));
    let (handed_in, here, differs) = match grade {
        Grade::Failed(reason) => {
            let mut lines = vec![format!("{file}: does not run")];
            lines.extend(reason.trim_end().lines().map(|line| format!("    {}", printable(line))));
            return lines;
        }
        Grade::Ran { handed_in, here, differs } => (handed_in, here, differs),
    };
    let held = here.expectations.iter().filter(|one| one.held).count();
    let by = printable(&handed_in.by);
    let mut lines = vec![format!("{file}: {by}: {held} of {} held", here.expectations.len())];
    for one in &here.expectations {
        let name = one.name.as_ref().map_or(String::new(), |name| format!("{name}: "));
        let verdict = if one.held { "held  " } else { "FAILED" };
        let since = match (one.held_at, one.since) {
            (Some(held), Some(since)) if held < since => format!("; {}", later(held, since)),
            (Some(_), Some(since)) => format!("; since {since:.1} s"),
            _ => String::new(),
        };
        lines.push(format!("    {verdict}  {name}{}{since}", one.text));
    }
    if !here.success && held == here.expectations.len() {
        lines.push("    FAILED  a script had an error".to_owned());
    }
    lines.extend(differs.iter().map(|reason| format!("    note: {}", printable(reason))));
    let others: Vec<String> =
        others(path, handed_in, twins).into_iter().map(|path| printable(&name(path))).collect();
    if !others.is_empty() {
        lines.push(format!("    note: the same scripts as {}", others.join(", ")));
    }
    lines
}

fn object(path: &Path, grade: &Grade, twins: &BTreeMap<Vec<&str>, Vec<&Path>>) -> Value {
    match grade {
        Grade::Failed(reason) => json!({ "file": name(path), "runs": false, "reason": reason }),
        Grade::Ran { handed_in, here, differs } => json!({
            "file": name(path),
            "by": handed_in.by,
            "runs": true,
            "success": here.success,
            "expectations": here.expectations,
            "digest": here.digest,
            "as_handed_in": differs.is_none(),
            "reason": differs,
            "same_scripts": others(path, handed_in, twins).into_iter().map(name).collect::<Vec<_>>(),
        }),
    }
}
