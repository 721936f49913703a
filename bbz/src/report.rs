//! Messages on standard error.

use annotate_snippets::{AnnotationKind, Group, Level, Renderer as Style, Snippet};
use bittybuzz_compiler::diagnostic::{Diagnostic, Severity};
use bittybuzz_compiler::render::{Color, Renderer};
use bittybuzz_compiler::source::SourceMap;
use bittybuzz_robots::Place;

use crate::problem::Problem;

/// Prints what the compiler says about a script.
pub fn diagnostics(sources: &SourceMap, diagnostics: &[Diagnostic]) {
    let renderer = Renderer::new(sources);
    for diagnostic in diagnostics {
        // Standard error drops the colours where nobody would see them.
        anstream::eprint!("{}", renderer.text(diagnostic, Color::Always));
    }
}

/// How many errors and warnings there are.
pub fn count(diagnostics: &[Diagnostic]) -> (usize, usize) {
    let is_error = |diagnostic: &&Diagnostic| diagnostic.severity() == Severity::Error;
    let errors = diagnostics.iter().filter(is_error).count();
    (errors, diagnostics.len() - errors)
}

/// Prints what is wrong with the command line or a file.
pub fn problem(problem: &Problem) {
    mistake(&problem.to_string(), problem.place(), problem.help());
}

/// Prints an error, where it is, and what to do about it.
pub fn mistake(message: &str, place: Option<&Place>, help: Option<String>) {
    let title = Level::ERROR.primary_title(message);
    let Some(place) = place else {
        print(Group::with_title(title));
        if let Some(help) = help {
            print(Group::with_title(Level::HELP.primary_title(help)));
        }
        return;
    };
    let start = place.source.char_indices().nth(place.column - 1).map_or(0, |(at, _)| at);
    let end = place.source[start..].char_indices().nth(place.width).map(|(at, _)| start + at);
    let mark = AnnotationKind::Primary.span(start..end.unwrap_or(place.source.len()));
    let snippet = Snippet::source(&place.source).line_start(place.line).path(&place.path);
    let help = help.map(|help| Level::HELP.message(help));
    print(title.element(snippet.annotation(mark)).elements(help));
}

/// Prints a warning that concerns no place in a script.
pub fn warning(message: &str, note: Option<&str>) {
    print(Group::with_title(Level::WARNING.primary_title(message)));
    if let Some(note) = note {
        print(Group::with_title(Level::NOTE.primary_title(note)));
    }
}

/// Text from scripts and symbols must not control the terminal. Titles and source lines are made harmless when they
/// are printed, other text is not.
pub fn printable(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect()
}

/// Prints a message.
pub fn print(group: Group<'_>) {
    anstream::eprintln!("{}", Style::styled().render(&[group]));
}
