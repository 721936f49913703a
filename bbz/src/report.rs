//! Messages on standard error. All text passes the filter of [`crate::escape`].

use std::backtrace::{Backtrace, BacktraceStatus};
use std::fmt;
use std::io::Write;

use annotate_snippets::{AnnotationKind, Group, Level, Renderer as Style, Snippet};
use bittybuzz_compiler::diagnostic::{Diagnostic, Severity};
use bittybuzz_compiler::render::{ColorChoice, Renderer};
use bittybuzz_compiler::source::SourceMap;
pub use bittybuzz_fault::printable;
use bittybuzz_live::Defect;
use bittybuzz_toml_reader::Place;

use crate::escape::{colored, escaped};
use crate::launch;
use crate::problem::{Problem, ProblemMessage};

/// The most errors, and the most warnings, of a script that are printed; `--json` has all.
pub const MESSAGES_MAX: usize = 100;

/// Prints the compiler's messages about a script.
pub fn diagnostics(sources: &SourceMap, diagnostics: &[Diagnostic]) {
    let renderer = Renderer::new(sources);
    let (mut errors, mut warnings) = (0, 0);
    for diagnostic in diagnostics {
        let count = match diagnostic.severity() {
            Severity::Error => &mut errors,
            Severity::Warning => &mut warnings,
        };
        *count += 1;
        if *count > MESSAGES_MAX {
            continue;
        }
        let plain = renderer.text(diagnostic, ColorChoice::Never);
        write(&colored(&plain, || renderer.text(diagnostic, ColorChoice::Always)));
    }
    if let Some(title) = not_shown(errors, warnings) {
        print(Group::with_title(Level::NOTE.primary_title(title)));
    }
}

/// Returns `2 more errors and 1 more warning are not shown`, or `None` if all are shown.
fn not_shown(errors: usize, warnings: usize) -> Option<String> {
    let more = |count: usize, what: &str| match count.saturating_sub(MESSAGES_MAX) {
        0 => None,
        1 => Some((1, format!("1 more {what}"))),
        more => Some((more, format!("{more} more {what}s"))),
    };
    let (counts, parts): (Vec<usize>, Vec<String>) =
        [more(errors, "error"), more(warnings, "warning")].into_iter().flatten().unzip();
    let verb = if counts == [1] { "is" } else { "are" };
    (!parts.is_empty()).then(|| format!("{} {verb} not shown", parts.join(" and ")))
}

/// Returns the number of errors and warnings.
pub fn count(diagnostics: &[Diagnostic]) -> (usize, usize) {
    let is_error = |diagnostic: &&Diagnostic| diagnostic.severity() == Severity::Error;
    let errors = diagnostics.iter().filter(is_error).count();
    (errors, diagnostics.len() - errors)
}

/// Returns a count with its noun: `1 error`, `2 errors`.
pub fn counted(count: impl TryInto<u64, Error: fmt::Debug>, noun: &str) -> String {
    let count = count.try_into().expect("a count is not negative, and has at most 64 bits");
    let plural = if count == 1 { "" } else { "s" };
    format!("{count} {noun}{plural}")
}

/// Prints a mistake in the command line or a file.
pub fn problem(problem: &dyn Problem) {
    for ProblemMessage { text, place, help } in problem.messages() {
        mistake(&text, place, help);
    }
}

/// Prints a defect of this program that no boundary has caught, and its backtrace if the environment
/// asks for one.
pub fn defect(defect: &Defect) {
    let advice = Defect::advice(&launch::command_line());
    mistake(&defect.to_string(), None, Some(advice));
    let backtrace = Backtrace::capture();
    if backtrace.status() == BacktraceStatus::Captured {
        write(&escaped(&backtrace.to_string()));
    }
}

/// Prints an error, its place, and the advice on how to mend it.
pub fn mistake(message: &str, place: Option<&Place>, help: Option<String>) {
    if let Some(place) = place {
        return at(place, Level::ERROR, message, help);
    }
    print(Group::with_title(Level::ERROR.primary_title(message)));
    if let Some(help) = help {
        print(Group::with_title(Level::HELP.primary_title(help)));
    }
}

/// Prints a warning, its place, and the advice on how to mend it.
pub fn doubt(message: &str, place: &Place, help: String) {
    at(place, Level::WARNING, message, Some(help));
}

fn at(place: &Place, level: Level<'_>, message: &str, help: Option<String>) {
    let title = level.primary_title(message);
    let before = place.column - place.source_column;
    let start = place.source.char_indices().nth(before).map_or(place.source.len(), |(at, _)| at);
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

/// Prints lines that are not a message: a report at the end of a run.
pub fn lines(lines: &[String]) {
    for line in lines {
        write(&escaped(&format!("{line}\n")));
    }
}

/// Prints a mistake in the command line, or the help that was asked for, which goes to standard output.
pub fn command_line(message: &clap::Error) {
    let plain = message.render().to_string();
    let text = colored(&plain, || message.render().ansi().to_string());
    if message.use_stderr() {
        write(&text);
    } else {
        let _ = anstream::stdout().write_all(text.as_bytes());
    }
}

/// Prints a message.
pub fn print(group: Group<'_>) {
    let groups = [group];
    let plain = Style::plain().render(&groups);
    write(&format!("{}\n", colored(&plain, || Style::styled().render(&groups))));
}

/// Writes to standard error, without colors unless it is a terminal. A failure is ignored, because
/// there is no place left to report it.
fn write(text: &str) {
    let _ = anstream::stderr().write_all(text.as_bytes());
}

#[cfg(test)]
mod tests {
    use std::env;
    use std::process::Command;

    use super::*;
    use crate::launch::Launch;

    /// The environment variable of the process that has the defect.
    const CHILD: &str = "BBZ_TEST_OF_A_DEFECT";

    /// The test starts itself in another process, because the hook holds for a whole process.
    #[test]
    fn an_uncaught_defect_is_printed_with_its_command() {
        if env::var_os(CHILD).is_some() {
            launch::begin(Launch::of_program()).unwrap();
            Defect::print_uncaught_by(defect);
            panic!("robot 7 is missing");
        }
        let name = "report::tests::an_uncaught_defect_is_printed_with_its_command";
        let program = env::current_exe().unwrap();
        let mut child = Command::new(&program);
        child.args(["--exact", name, "--nocapture"]).env(CHILD, "1").env("RUST_BACKTRACE", "0");
        let output = child.output().unwrap();
        let printed = String::from_utf8(output.stderr).unwrap().replace('\\', "/");
        let version = env!("CARGO_PKG_VERSION");
        let start = format!("error: defect of bbz {version} at bbz/src/report.rs:");
        let command = format!(": {} --exact {name} --nocapture\n", program.display());
        assert!(!output.status.success());
        assert!(printed.starts_with(&start), "{printed}");
        assert!(printed.contains(": robot 7 is missing\nhelp: "), "{printed}");
        assert!(printed.contains(&command.replace('\\', "/")), "{printed}");
        assert!(!printed.contains("panicked"), "{printed}");
    }
}
