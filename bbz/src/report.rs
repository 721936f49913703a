//! Messages on standard error.

use annotate_snippets::{Group, Level, Renderer as Style};
use bittybuzz_compiler::diagnostic::{Diagnostic, Severity};
use bittybuzz_compiler::render::{Color, Renderer};
use bittybuzz_compiler::source::SourceMap;

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

/// Prints an error that concerns no place in a script.
pub fn error(message: &str, help: Option<&str>) {
    let mut group = Group::with_title(Level::ERROR.primary_title(message));
    if let Some(help) = help {
        group = group.element(Level::HELP.message(help));
    }
    print(group);
}

/// Prints a warning that concerns no place in a script.
pub fn warning(message: &str, note: &str) {
    let group = Group::with_title(Level::WARNING.primary_title(message));
    print(group.element(Level::NOTE.message(note)));
}

/// Prints a message.
pub fn print(group: Group<'_>) {
    anstream::eprintln!("{}", Style::styled().render(&[group]));
}
