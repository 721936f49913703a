//! Comments that address the page of `bbz sim --view`: the meanings of LED colors, controls, and
//! texts in another language.
//!
//! Such a comment stands on a line of its own: a kind, perhaps with the code of a language, a colon
//! and a text. Other comments are remarks. A comment with one of these kinds that cannot be read, or
//! that stands where it has no effect, gets the warning W0113.
//!
//! ```text
//! # led: 2 = in a group
//! # led.fr: 2 = dans un groupe
//! # slider: JOIN 1..50 step 1
//! # text.fr: Un script d'essai.
//! ```

pub mod controls;
pub mod leds;
pub mod texts;

use crate::codes::DiagnosticCode;
use crate::diagnostic::Diagnostic;
use crate::source::{SourceMap, Span};

/// A comment that was meant for the page, and that the page cannot use.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CommentProblem {
    /// The number of the line, from 0.
    pub line: usize,
    /// The mistake in one sentence without a full stop.
    pub message: String,
    /// Advice how to correct it.
    pub help: String,
}

impl CommentProblem {
    /// Returns a mistake in a line, from 0.
    pub fn new(line: usize, message: impl Into<String>, help: impl Into<String>) -> Self {
        CommentProblem { line, message: message.into(), help: help.into() }
    }
}

/// A comment with a line of its own that begins with a kind.
#[derive(Debug, Clone, Copy)]
pub struct PageComment<'a> {
    /// The number of the line, from 0.
    pub line: usize,
    pub kind: &'a str,
    /// The code of the language; `None` is the language of the file.
    pub language: Option<&'a str>,
    /// The text after the colon.
    pub text: &'a str,
}

/// Returns the comments of the form `# kind: text` and `# kind.fr: text`.
pub fn page_comments(text: &str) -> impl Iterator<Item = PageComment<'_>> {
    text.lines().enumerate().filter_map(|(line, text)| {
        let (kind, text) = text.trim().strip_prefix('#')?.split_once(':')?;
        let (kind, language) = split_language(kind);
        Some(PageComment { line, kind, language, text: text.trim() })
    })
}

/// Splits the kind of a comment, such as `led.fr`, into the kind and the code of the language.
pub fn split_language(kind: &str) -> (&str, Option<&str>) {
    match kind.trim().split_once('.') {
        Some((kind, language)) => (kind, Some(language)),
        None => (kind.trim(), None),
    }
}

/// Returns true for a comment, without its `#`, that is a request to the page and no text.
pub fn is_request(comment: &str) -> bool {
    let kind = comment.split_once(':').map_or("", |(kind, _)| split_language(kind).0);
    ["led", "try", "slider", "switch", "button"].contains(&kind)
}

/// Returns the help about the code of a language that no page asks for; `None` for a code of two
/// small letters, which browsers send (ISO 639-1).
pub fn language_problem(kind: &str, language: Option<&str>) -> Option<String> {
    let is_code = |code: &str| code.len() == 2 && code.bytes().all(|one| one.is_ascii_lowercase());
    let is_wrong = language.is_some_and(|code| !is_code(code));
    is_wrong.then(|| format!("a language is a code of two small letters: `# {kind}.fr: …`"))
}

/// Returns a warning for each comment of a script and of the files that it includes that was meant
/// for the page, and that the page cannot use.
pub fn warnings(sources: &SourceMap) -> Vec<Diagnostic> {
    let mut warnings = Vec::new();
    for (file, source) in sources.files() {
        let mut problems = problems(&source.text).into_iter().peekable();
        if problems.peek().is_none() {
            continue;
        }
        let spans = comment_spans(&source.text);
        warnings.extend(problems.map(|CommentProblem { line, message, help }| {
            let (start, end) = spans[line];
            let span = Span { file, start: start as u32, end: end as u32 };
            Diagnostic::new(DiagnosticCode::UnusablePageComment, span, message).help(help)
        }));
    }
    warnings
}

/// Returns the malformed and misplaced comments of a script.
fn problems(text: &str) -> Vec<CommentProblem> {
    let leds = leds::read(text).into_iter().filter_map(Result::err);
    let controls = controls::read(text).into_iter().filter_map(Result::err);
    let commands = page_comments(text).filter(|one| one.kind == "try" && one.text.contains('='));
    let commands = commands.map(|PageComment { line, .. }| {
        let help = "write the comment `# try: …` in the scenario";
        CommentProblem::new(line, "a script proposes no commands", help)
    });
    leds.chain(controls).chain(texts::problems(text)).chain(commands).collect()
}

/// Returns for each line of a text where its comment begins and ends, in bytes.
pub fn comment_spans(text: &str) -> Vec<(usize, usize)> {
    let mut next = 0;
    let spans = text.split('\n').map(|line| {
        let start = next;
        next += line.len() + 1;
        (start + line.find('#').unwrap_or(0), start + line.trim_end().len())
    });
    spans.collect()
}
