//! Each assignment of examples/lessons can be solved, is not solved yet when learners get it, and is
//! not solved by a typical wrong answer.

use std::fs;
use std::path::PathBuf;

use bittybuzz_tests::{bbz, files, report};
use bittybuzz_toml_reader::{self as toml_reader, FileError, SourceText, TomlError};

/// Neither a solution nor a wrong answer may depend on chance.
const SEEDS: u32 = 10;

/// The wrong answers, as changes to the solutions.
const WRONG: &str = "tests/lessons/wrong.toml";

/// A script in the place of the one that learners get.
struct Answer {
    lesson: String,
    /// A few words for messages of this test.
    name: String,
    /// The path from the folder of the scenario, or an absolute one; `None` is the script that
    /// learners get.
    script: Option<String>,
    /// The number of seeds for which all expectations hold.
    succeeding: u32,
}

#[test]
fn solutions_hold_and_other_answers_fail() {
    bbz::path();
    let lessons = lessons();
    let wrong = wrong_answers();
    for lesson in &lessons {
        let count = wrong.iter().filter(|(of, ..)| of == lesson).count();
        assert!(count >= 4, "{lesson} has {count} wrong answers");
    }
    let folder = Folder::new("answers");
    let mut answers = Vec::new();
    for lesson in lessons {
        let (name, of) = ("what learners get".to_owned(), lesson.clone());
        answers.push(Answer { lesson: of, name, script: None, succeeding: 0 });
        let script = Some(format!("solutions/{lesson}.bzz"));
        answers.push(Answer { lesson, name: "solution".to_owned(), script, succeeding: SEEDS });
    }
    for (number, (lesson, name, text)) in wrong.into_iter().enumerate() {
        let path = folder.0.join(format!("{number}.bzz"));
        fs::write(&path, text).unwrap();
        let script = Some(path.display().to_string());
        answers.push(Answer { lesson, name, script, succeeding: 0 });
    }
    let failures: Vec<_> = files::in_parallel(&answers, check).into_iter().flatten().collect();
    report::conclude("answers", answers.len(), 60, &failures);
}

/// The plans for teachers list every wrong answer with the expectations that fail.
#[test]
fn plans_name_the_lights_of_wrong_answers() {
    bbz::path();
    let plans = files::read("docs/lessons/teachers.md");
    let folder = Folder::new("plans");
    let wrong: Vec<_> = wrong_answers().into_iter().enumerate().collect();
    let check = |(number, (lesson, mistake, text)): &(usize, (String, String, String))| {
        let path = folder.0.join(format!("{number}.bzz"));
        fs::write(&path, text).unwrap();
        let outcome = run(lesson, Some(&path.display().to_string()), &["--headless"]);
        let failed = outcome.stdout.lines().filter(|line| line.starts_with("FAILED "));
        // FAILED  examples/lessons/rhythm.toml:34: first_dark: all: led equals 0, ...
        let names = failed.map(|line| format!("`{}`", line.split(": ").nth(1).unwrap()));
        let row = format!("| {mistake} | {} |", names.collect::<Vec<_>>().join(", "));
        let title = title(lesson);
        let section = plans.split("\n## ").find(|section| section.contains(&title));
        let is_listed = section.is_some_and(|section| section.contains(&row));
        (!is_listed).then(|| format!("{lesson} needs this row: {row}"))
    };
    let failures: Vec<_> = files::in_parallel(&wrong, check).into_iter().flatten().collect();
    report::conclude("wrong answers", wrong.len(), 60, &failures);
}

/// Returns the title of a lesson's assignment.
fn title(lesson: &str) -> String {
    let text = files::read(&format!("examples/lessons/{lesson}.toml"));
    let title = text.lines().find_map(|line| line.strip_prefix("title = \""));
    title.unwrap().trim_end_matches('"').to_owned()
}

/// Runs an answer.
fn run(lesson: &str, script: Option<&str>, more: &[&str]) -> bbz::Outcome {
    let path = format!("examples/lessons/{lesson}.toml");
    let mut arguments = vec!["sim".to_owned(), path.clone()];
    arguments.extend(more.iter().map(|&argument| argument.to_owned()));
    if let Some(script) = script {
        let groups = files::read(&path).matches("\n[[robots]]\n").count();
        let values = (0..groups).map(|group| format!("robots.{group}.script={script}"));
        arguments.extend(values.flat_map(|value| ["--set".to_owned(), value]));
    }
    bbz::run(&arguments, &[])
}

/// Runs an answer with all seeds.
fn check(answer: &Answer) -> Option<String> {
    let Answer { lesson, name, script, succeeding } = answer;
    let outcome = run(lesson, script.as_deref(), &["--runs", &SEEDS.to_string()]);
    let wanted = format!(": {succeeding} of {SEEDS} runs succeeded\n");
    let is_right = outcome.stdout.contains(&wanted);
    (!is_right).then(|| format!("{lesson}, {name}:\n{}{}", outcome.stdout, outcome.stderr))
}

/// The names of the lessons.
fn lessons() -> Vec<String> {
    let mut paths = files::with_extension("examples/lessons", "toml");
    // The others are robot files.
    paths.retain(|path| files::read(path).contains("\n[assignment]\n"));
    let name = |path: &String| {
        path.trim_start_matches("examples/lessons/").trim_end_matches(".toml").to_owned()
    };
    paths.iter().map(name).collect()
}

/// A folder for scripts, which is removed in the end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("bbz-{name}-{}", std::process::id()));
        fs::create_dir_all(&path).unwrap();
        Folder(path)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        // What stays is removed with the other temporary files of the computer.
        let _ = fs::remove_dir_all(&self.0);
    }
}

type Section<'a> = toml_reader::Section<'a, TomlError>;
type Entry<'a> = toml_reader::TomlEntry<'a, TomlError>;

const ROOT: &str = "the list";
const ANSWER: &str = "this [[wrong]]";

/// The lesson, the mistake and the text of each wrong answer.
fn wrong_answers() -> Vec<(String, String, String)> {
    let keys = |section| match section {
        ROOT => vec!["wrong"],
        _ => vec!["lesson", "mistake", "replace"],
    };
    let text = files::read(WRONG);
    let read = toml_reader::read(&SourceText::new(WRONG, &text), &[], (ROOT, &keys), |root| {
        root.sections("wrong", ANSWER).iter().map(wrong_answer).collect::<Option<Vec<_>>>()
    });
    read.unwrap_or_else(|errors: Vec<FileError<TomlError>>| {
        panic!("{WRONG}: {}", errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))
    })
}

fn wrong_answer(section: &Section<'_>) -> Option<(String, String, String)> {
    let lesson = section.required("lesson")?.string()?.to_owned();
    let mistake = section.required("mistake")?.string()?.to_owned();
    let mut text = files::read(&format!("examples/lessons/solutions/{lesson}.bzz"));
    for pair in section.required("replace")?.list()? {
        let texts = pair.list()?.iter().map(Entry::string).collect::<Option<Vec<&str>>>()?;
        let [old, new] = texts[..] else { panic!("{lesson}, {mistake}: a change is two texts") };
        assert!(text.contains(old), "{lesson}, {mistake}: the solution has no `{old}`");
        text = text.replace(old, new);
    }
    Some((lesson, mistake, text))
}
