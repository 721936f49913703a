//! Public Buzz scripts: `bbz check` reports no error in them but those that are listed in `corpus.toml`, each with its
//! reason. Programs (scripts with a `step`) also run 200 steps alone, and a minute as ten robots, except those whose
//! fault is listed. The scripts themselves are not part of this repository.
//!
//! A script is checked for the robot that its author had. Where no robot file of this repository describes it, `bbz
//! stubs` writes one from the functions that the script calls and does not define; each of these has to be listed, so
//! that a function which the compiler overlooks is not taken for the robot's.
//!
//! What a program prints in its first steps is what it prints with Buzz ([`log`]), except where its entry gives a reason.

mod log;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use crate::Verdict;
use crate::simulator::Build;
use crate::sources::write;
use anyhow::{Context, Result, ensure};
use bittybuzz_builds::shell::{Invocation, root, target};
use fs_err as fs;
use serde::Deserialize;
use serde_json::Value;

pub const MADE_OF: &[&str] = &[
    "Cargo",
    "bbz/src/",
    "compiler/src/",
    "lib/",
    "robots/",
    "spec/",
    "vm-core/src/",
    "tests/soak/corpus.toml",
    "tests/soak/src/corpus/",
];

const LIST: &str = include_str!("../../corpus.toml");

/// The environment variable with the folder that holds the scripts of each repository, as `OWNER/NAME/PATH`.
const FOLDER: &str = "BITTYBUZZ_CORPUS";

/// Exit statuses of `bbz`.
const SUCCESS: i32 = 0;
const RUN_TIME_ERROR: i32 = 1;
const COMPILE_ERROR: i32 = 2;

/// The code of a mistake in the compiler.
const INTERNAL: &str = "E0699";

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Corpus {
    repository: Vec<Repository>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Repository {
    /// Owner and name on GitHub.
    name: String,
    commit: String,
    /// Folders that are searched for included files.
    include: Vec<String>,
    /// Functions that the scripts call and that the robot's program has.
    #[serde(default)]
    robot: BTreeSet<String>,
    /// Functions that a script calls and that those scripts define which include it, or which run before it.
    #[serde(default)]
    other_scripts: BTreeSet<String>,
    /// Functions that nothing in the repository defines.
    #[serde(default)]
    nowhere: BTreeSet<String>,
    script: Vec<Script>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Script {
    path: String,
    /// The hash by which git names the content: `git hash-object PATH`.
    blob: String,
    /// A robot of this repository; without, `bbz stubs` makes one.
    robot: Option<String>,
    #[serde(default)]
    errors: Vec<Expected>,
    /// Whether it runs on a robot; else other scripts include it.
    #[serde(default)]
    program: bool,
    /// The fault that stops it.
    stops: Option<Stop>,
    /// The hash of what it prints in its first steps, with Buzz and here.
    log: Option<String>,
    /// The reason why a program has none.
    no_log: Option<String>,
}

/// A run-time error of a program.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Stop {
    code: String,
    /// Whether the program stops alone, too: some stop only when they hear others.
    alone: bool,
    /// The cause in this program.
    note: String,
}

impl Script {
    /// Whether it is a program that nothing stops.
    fn runs(&self) -> bool {
        self.program && self.errors.is_empty() && self.stops.is_none()
    }
}

/// Errors of one code in a script.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Expected {
    code: String,
    count: usize,
    reason: Reason,
    /// The cause in this script.
    note: String,
}

/// A reason why errors in a public script are no mistakes of the compiler.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Reason {
    /// The script has a syntax error, so that no robot can be made from its calls.
    RobotFunction,
    /// The script uses files, which robots do not have.
    Files,
    /// The reference compiler refuses the script, too.
    RefusedByReference,
    /// The script works on the reference compiler but cannot do what its author wants.
    TrueMistake,
    /// The script calls a function that its host adds to a library of the language.
    HostLibrary,
    /// A difference from the reference that COMPATIBILITY.md lists.
    Difference,
}

impl Reason {
    fn text(self) -> &'static str {
        match self {
            Reason::RobotFunction => "a function of the robot",
            Reason::Files => "files",
            Reason::RefusedByReference => "the reference refuses it, too",
            Reason::TrueMistake => "a mistake of the script",
            Reason::HostLibrary => "a function that its host adds to a library",
            Reason::Difference => "a difference from the reference",
        }
    }
}

fn corpus() -> Result<Corpus> {
    toml::from_str(LIST).context("tests/soak/corpus.toml")
}

/// Names of the repositories.
pub fn items() -> Vec<String> {
    let names = |corpus: Corpus| corpus.repository.into_iter().map(|known| known.name).collect();
    corpus().map(names).unwrap_or_default()
}

/// Checks the scripts of a repository.
pub fn run(item: &str) -> Result<Verdict> {
    let corpus = corpus()?;
    let Some(repository) = corpus.repository.iter().find(|known| known.name == item) else {
        return Ok(Verdict::Missing("no such repository".to_owned()));
    };
    let Repository { name, commit, .. } = repository;
    let Some(folder) = std::env::var_os(FOLDER) else {
        return Ok(Verdict::Missing(format!(
            "set {FOLDER} to a folder with the scripts of github.com/{name} at {commit} in {name}/"
        )));
    };
    let folder = root().join(folder).join(name);
    if !folder.is_dir() {
        return Ok(Verdict::Missing(format!(
            "{} does not exist: it holds the scripts of github.com/{name} at {commit}",
            folder.display()
        )));
    }
    let mut problems = compare_files(repository, &folder)?;
    if problems.is_empty() {
        let bbz = Build::Checked.simulator()?;
        let include: Vec<PathBuf> =
            repository.include.iter().map(|path| folder.join(path)).collect();
        let checker =
            Checker { bbz, include, robot_file: target()?.join("soak/corpus/robot.toml") };
        for script in &repository.script {
            let found = checker.problems(repository, script, &folder.join(&script.path))?;
            problems.extend(found.into_iter().map(|problem| format!("{}: {problem}", script.path)));
        }
    }
    if !problems.is_empty() {
        return Ok(Verdict::Missing(problems.join("; ")));
    }
    let count = |holds: fn(&Script) -> bool| repository.script.iter().filter(|s| holds(s)).count();
    Ok(Verdict::Shown(format!(
        "{} scripts without errors, {} with those listed; {} programs run, {} do not; {} logs as with \
         Buzz, {} not comparable",
        count(|script| script.errors.is_empty()),
        count(|script| !script.errors.is_empty()),
        count(Script::runs),
        count(|script| script.program && !script.runs()),
        count(|script| script.log.is_some()),
        count(|script| script.no_log.is_some()),
    )))
}

/// Names scripts that are not there, have another content, or are not listed.
fn compare_files(repository: &Repository, folder: &Path) -> Result<Vec<String>> {
    let mut paths = Vec::new();
    collect(folder, &mut paths)?;
    let mut arguments = vec!["hash-object".to_owned(), "--no-filters".to_owned(), "--".to_owned()];
    arguments.extend(paths.iter().map(|path| path.display().to_string()));
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let output = Invocation::new("git", &arguments).unannounced().output(SUCCESS)?;
    let hashes = String::from_utf8(output.stdout)?;
    ensure!(hashes.lines().count() == paths.len(), "git hash-object did not name every script");
    let mut found: BTreeMap<String, &str> = paths
        .iter()
        .zip(hashes.lines())
        .filter_map(|(path, hash)| Some((relative(path, folder)?, hash)))
        .collect();
    let mut problems = Vec::new();
    for script in &repository.script {
        match found.remove(&script.path) {
            None => problems.push(format!("{} is not there", script.path)),
            Some(hash) if hash != script.blob => {
                problems.push(format!("{} has another content: {hash}", script.path));
            }
            Some(_) => {}
        }
    }
    problems.extend(found.iter().map(|(path, hash)| format!("{path} ({hash}) is not listed")));
    if !problems.is_empty() {
        problems.push(format!("the list is about commit {}", repository.commit));
    }
    Ok(problems)
}

fn relative(path: &Path, folder: &Path) -> Option<String> {
    Some(path.strip_prefix(folder).ok()?.to_string_lossy().replace('\\', "/"))
}

/// Adds the scripts of a folder. Links are left out: one may lead back to the folder that it is in.
fn collect(folder: &Path, found: &mut Vec<PathBuf>) -> Result<()> {
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let path = entry.path();
        if entry.file_type()?.is_dir() {
            collect(&path, found)?;
        } else if path.extension().is_some_and(|extension| extension == "bzz") {
            found.push(path);
        }
    }
    Ok(())
}

struct Checker {
    bbz: PathBuf,
    include: Vec<PathBuf>,
    /// The file to which `bbz stubs` writes.
    robot_file: PathBuf,
}

impl Checker {
    /// Differences between the listed errors of a script and those that `bbz check` reports.
    fn problems(
        &self,
        repository: &Repository,
        script: &Script,
        path: &Path,
    ) -> Result<Vec<String>> {
        let path = path.display().to_string();
        let mut problems = Vec::new();
        let robot = match &script.robot {
            Some(robot) => Some(robot.clone()),
            None => self.listed_stubs(repository, &path, &mut problems)?,
        };
        if let Some(recorded) = &script.log {
            problems.extend(self.logs(recorded, &path)?);
        }
        if script.program && script.errors.is_empty() {
            let robot = robot.as_deref().context("a program without errors has a robot")?;
            problems.extend(self.runs(script, &path, robot)?);
        }
        let robot = robot.iter().flat_map(|robot| ["--robot", robot]);
        let check: Vec<&str> = ["check", "--json", &path].into_iter().chain(robot).collect();
        let found = self.errors(&check)?;
        let listed: BTreeMap<&str, &Expected> =
            script.errors.iter().map(|error| (error.code.as_str(), error)).collect();
        let codes = found.keys().map(String::as_str).chain(listed.keys().copied());
        for code in codes.collect::<BTreeSet<_>>() {
            let messages = found.get(code).map_or(&[][..], Vec::as_slice);
            match listed.get(code) {
                Some(error) if error.count == messages.len() => {}
                Some(Expected { count, reason, note, .. }) => problems.push(format!(
                    "{} of {code} in place of {count} ({}: {note})",
                    messages.len(),
                    reason.text()
                )),
                None => {
                    let first = messages.first().map_or("", String::as_str);
                    problems.push(format!(
                        "{} of {code}, which is not listed: {first}",
                        messages.len()
                    ));
                }
            }
        }
        // With small numbers other errors are right, but not every end.
        let small = self.errors(&[&check[..], &["--profile", "tiny"]].concat())?;
        if small.contains_key(INTERNAL) {
            problems.push(format!("{INTERNAL} in the `tiny` profile"));
        }
        Ok(problems)
    }

    /// Runs a program alone and as ten robots; the differences from the listed fault.
    fn runs(&self, script: &Script, path: &str, robot: &str) -> Result<Vec<String>> {
        let alone = ["run", path, "--robot", robot, "--steps", "200"];
        let ten = ["sim", path, "--robot", robot, "--count", "10", "--headless"];
        let stops = script.stops.as_ref();
        let mut problems = Vec::new();
        for (arguments, expected) in
            [(&alone[..], stops.filter(|stop| stop.alone)), (&ten[..], stops)]
        {
            let ended = self.bbz(arguments)?;
            let first = ended.errors.lines().find(|line| line.starts_with("error"));
            let as_listed = match expected {
                None => ended.status == SUCCESS,
                Some(stop) => {
                    let code = format!("error[{}]", stop.code);
                    ended.status == RUN_TIME_ERROR && first.is_some_and(|it| it.starts_with(&code))
                }
            };
            if !as_listed {
                let listed = expected.map_or("nothing".to_owned(), |stop| {
                    let Stop { code, note, .. } = stop;
                    format!("{code} ({note})")
                });
                let first = first.unwrap_or("no error");
                problems.push(format!("`bbz {}`: {first}, listed is {listed}", arguments[0]));
            }
        }
        Ok(problems)
    }

    /// Runs the first steps of a program without a host; the differences of its log from the recorded one.
    fn logs(&self, recorded: &str, program: &str) -> Result<Vec<String>> {
        let robot = self.stubs(program)?.context("a program with a log has a robot")?;
        let path = self.robot_file.with_file_name("program.bzz");
        log::write_script(&path, &robot, program)?;
        let ended = self.bbz(&["run", &path.display().to_string(), "--steps", "0"])?;
        let here = log::hash(&ended.text, ended.status != SUCCESS);
        // Buzz does not look beside the including file.
        let beside = Path::new(program).parent().map(Path::to_path_buf);
        let include: Vec<PathBuf> = beside.into_iter().chain(self.include.clone()).collect();
        let buzz = log::with_buzz(&path, &include)?;
        let found = [("here", Some(here)), ("with Buzz", buzz)];
        let differs = |(place, log): (&str, Option<String>)| {
            let log = log.filter(|log| log != recorded)?;
            Some(format!("the log {place} is {log} in place of {recorded}"))
        };
        Ok(found.into_iter().filter_map(differs).collect())
    }

    /// Makes a robot from the calls of a script; `None` if the script has a syntax error.
    fn stubs(&self, path: &str) -> Result<Option<toml::Table>> {
        write(&self.robot_file, b"")?;
        let output = self.robot_file.display().to_string();
        if self.bbz(&["stubs", path, "-o", &output])?.status == COMPILE_ERROR {
            return Ok(None);
        }
        Ok(Some(toml::from_str(&fs::read_to_string(&self.robot_file)?)?))
    }

    /// Returns the path of that robot, and names its functions that the list does not have.
    fn listed_stubs(
        &self,
        repository: &Repository,
        path: &str,
        problems: &mut Vec<String>,
    ) -> Result<Option<String>> {
        let Some(robot) = self.stubs(path)? else { return Ok(None) };
        let functions = robot.get("function").and_then(toml::Value::as_array).into_iter().flatten();
        let names = functions.filter_map(|function| function.get("name")?.as_str());
        let Repository { robot, other_scripts, nowhere, .. } = repository;
        let known = [robot, other_scripts, nowhere];
        let unlisted = names.filter(|name| !known.iter().any(|list| list.contains(*name)));
        problems.extend(unlisted.map(|name| format!("calls `{name}`, which is not listed")));
        Ok(Some(self.robot_file.display().to_string()))
    }

    /// The messages of all errors, by their codes.
    fn errors(&self, arguments: &[&str]) -> Result<BTreeMap<String, Vec<String>>> {
        let output = self.bbz(arguments)?;
        let report: Value = serde_json::from_str(&output.text)?;
        let mut errors: BTreeMap<String, Vec<String>> = BTreeMap::new();
        for found in report["diagnostics"].as_array().into_iter().flatten() {
            let text = |key: &str| found[key].as_str().unwrap_or_default().to_owned();
            if found["severity"] == "error" {
                errors.entry(text("code")).or_default().push(text("message"));
            }
        }
        ensure!(
            errors.is_empty() == (output.status == SUCCESS),
            "`bbz {}` ended with {} and {} kinds of errors",
            arguments.join(" "),
            output.status,
            errors.len()
        );
        Ok(errors)
    }

    /// Runs `bbz`, which succeeds or reports errors of a script: any other end is a failure of this part.
    fn bbz(&self, arguments: &[&str]) -> Result<Ended> {
        let include: Vec<String> =
            self.include.iter().map(|path| path.display().to_string()).collect();
        let include = include.iter().flat_map(|path| ["-I", path]);
        let arguments: Vec<&str> = arguments.iter().copied().chain(include).collect();
        let line = Invocation::named("bbz", &self.bbz, &arguments).without_env("BUZZ_INCLUDE_PATH");
        let is_right =
            |status: Option<i32>| matches!(status, Some(SUCCESS | RUN_TIME_ERROR | COMPILE_ERROR));
        let output = line.unannounced().output_if(|output| is_right(output.status.code()))?;
        Ok(Ended {
            status: output.status.code().unwrap_or_default(),
            text: String::from_utf8_lossy(&output.stdout).into_owned(),
            errors: String::from_utf8_lossy(&output.stderr).into_owned(),
        })
    }
}

/// The end of a run of `bbz`.
struct Ended {
    status: i32,
    text: String,
    errors: String,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_script_is_listed_once_and_every_error_has_its_reason() {
        let corpus = corpus().unwrap();
        let scripts = || corpus.repository.iter().flat_map(|repository| &repository.script);
        assert_eq!(scripts().count(), 304);
        for repository in &corpus.repository {
            let paths: BTreeSet<&str> =
                repository.script.iter().map(|script| script.path.as_str()).collect();
            assert_eq!(paths.len(), repository.script.len(), "{}", repository.name);
            assert!(is_hash(&repository.commit), "{}", repository.commit);
        }
        for script in scripts() {
            assert!(is_hash(&script.blob), "{}", script.path);
            let codes: BTreeSet<&str> =
                script.errors.iter().map(|error| error.code.as_str()).collect();
            assert_eq!(codes.len(), script.errors.len(), "{}", script.path);
            let has_log = script.program && script.errors.is_empty();
            let reasons = [script.log.is_some(), script.no_log.is_some()];
            let logs = reasons.into_iter().filter(|it| *it).count();
            assert_eq!(logs, usize::from(has_log), "{}: a log, or a reason", script.path);
            if let Some(stop) = &script.stops {
                let is_fault = stop.code.starts_with('R') && !stop.note.is_empty();
                assert!(script.program && is_fault, "{}: {stop:?}", script.path);
            }
            for error in &script.errors {
                assert!(
                    error.code.starts_with('E') && error.count > 0,
                    "{}: {error:?}",
                    script.path
                );
                assert!(!error.note.is_empty(), "{}: {error:?}", script.path);
                // A robot that was made from the calls of a script has all of them.
                let is_parsed = !script.errors.iter().any(|error| error.code.as_str() < "E04");
                let is_robots = error.reason == Reason::RobotFunction;
                assert!(!(is_robots && is_parsed), "{}: {error:?}", script.path);
            }
        }
    }

    fn is_hash(text: &str) -> bool {
        text.len() == 40 && text.chars().all(|c| c.is_ascii_hexdigit())
    }
}
