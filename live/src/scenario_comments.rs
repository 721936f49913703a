//! Warnings about the comments of a scenario that address the page, and that the page cannot use.

use bittybuzz_arena::scenario::Scenario;
use bittybuzz_compiler::comments::{
    CommentProblem, PageComment, comment_spans, language_problem, page_comments, texts,
};
use bittybuzz_toml_reader::{Place, SourceText};

use crate::about;

/// A comment of a scenario that was meant for the page, and that the page cannot use.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ScenarioWarning {
    /// The mistake in one sentence without a full stop.
    pub message: String,
    /// Advice how to correct it.
    pub help: String,
    pub place: Place,
}

/// Returns the warnings about a scenario with this text. `path` is its name in places.
pub fn scenario_warnings(text: &str, path: &str, scenario: &Scenario) -> Vec<ScenarioWarning> {
    let comments = page_comments(text).filter_map(|comment| problem(comment, scenario));
    let mut problems: Vec<CommentProblem> = comments.chain(texts::problems(text)).collect();
    if problems.is_empty() {
        return Vec::new();
    }
    problems.sort_by_key(|problem| problem.line);
    let (source, spans) = (SourceText::new(path, text), comment_spans(text));
    let warnings = problems.into_iter().map(|CommentProblem { line, message, help }| {
        let (start, end) = spans[line];
        ScenarioWarning { message, help, place: source.place(start..end) }
    });
    warnings.collect()
}

fn problem(comment: PageComment<'_>, scenario: &Scenario) -> Option<CommentProblem> {
    let PageComment { line, kind, language, text } = comment;
    match kind {
        "led" | "slider" | "switch" | "button" => Some(CommentProblem::new(
            line,
            format!("a scenario has no {kind} of the page"),
            format!("write the comment `# {kind}: …` in the script"),
        )),
        "try" => {
            let form = "this is no command to try";
            if let Some(help) = language_problem("try", language) {
                return Some(CommentProblem::new(line, form, help));
            }
            let Some((_, command)) = about::label_and_command(text) else {
                let help = "write a label, a colon and the keys of an `[[event]]` without `at`: \
                    `# try: Robot 15 fails: fail = 15`";
                return Some(CommentProblem::new(line, form, help));
            };
            let errors = scenario.command(&command).err()?;
            let error = errors.first()?;
            let help = error.help().unwrap_or_else(|| {
                "write the keys of an `[[event]]` without `at`, separated by commas".to_owned()
            });
            Some(CommentProblem::new(line, format!("{form}: {error}"), help))
        }
        _ => None,
    }
}
