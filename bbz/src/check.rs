//! `bbz check`: prints the messages of the compiler.

mod fix;

use std::path::{Path, PathBuf};

use annotate_snippets::{Group, Level};
use bittybuzz_compiler::codes::DiagnosticCode;
use bittybuzz_compiler::compile::Compiled;
use bittybuzz_compiler::diagnostic::{Diagnostic, Severity};
use bittybuzz_compiler::fit;
use clap::Args;

use crate::exit::ExitStatus;
use crate::json;
use crate::output;
use crate::problem::Problem;
use crate::program::RefusedImage;
use crate::program::{self, InputKind};
use crate::report;
use crate::selection::{RobotChoice, SelectionArguments};

const EXAMPLES: &str = "\
Examples:
  bbz check hello.bzz                    with the functions of every known robot
  bbz check hello.bzz --robot kilobot    can the Kilobot run it?
  bbz check *.bzz --deny warnings        for a build that accepts no warning
  bbz check hello.bzz --fix              mend clear mistakes, then check
  bbz check - --json < hello.bzz         for editors and other programs
  bbz check - --path src/hello.bzz < unsaved.bzz    as the text of src/hello.bzz

A comment `# bbz: allow(W0102)` silences a warning on its line, or on the next line with code.

Exit status: 0, or 2 compile error or denied warning, 3 wrong command line or file. Other warnings do not change it.
`bbz explain CODE` explains a message.";

/// Arguments of `bbz check`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct CheckArguments {
    /// Scripts (.bzz) or Buzz object files (.bo); `-` is a script on standard input
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Path of the script on standard input, for messages and included files; the file is not read
    #[arg(long, value_name = "FILE.bzz")]
    path: Option<PathBuf>,
    #[command(flatten)]
    selection: SelectionArguments,
    /// Folder to search for included files; may be given several times
    #[arg(short = 'I', value_name = "DIR")]
    include: Vec<PathBuf>,
    /// Warnings that count as errors: `warnings` for all, or a code such as W0102; may be given several times
    #[arg(long, value_name = "warnings|CODE", value_parser = denied)]
    deny: Vec<Denied>,
    /// Change the scripts where the mistake can mean nothing else, then check them
    #[arg(long)]
    fix: bool,
    /// Write the messages to standard output, as a JSON object
    #[arg(long)]
    json: bool,
}

/// A value of `--deny`.
#[derive(Debug, Clone, Copy)]
enum Denied {
    Warnings,
    Code(DiagnosticCode),
}

fn denied(text: &str) -> Result<Denied, String> {
    if text == "warnings" {
        return Ok(Denied::Warnings);
    }
    match DiagnosticCode::ALL.iter().find(|code| code.text().eq_ignore_ascii_case(text)) {
        Some(code) if code.severity() == Severity::Warning => Ok(Denied::Code(*code)),
        Some(_) => Err("it is an error anyway".to_owned()),
        None => Err("give `warnings`, or the code of a warning such as W0102".to_owned()),
    }
}

/// The messages about all files, and their counts.
struct CheckReport {
    objects: Vec<serde_json::Value>,
    errors: usize,
    warnings: usize,
    denied: usize,
    /// The code that the summary names.
    first: Option<DiagnosticCode>,
}

/// `--path` without a script on standard input, or with other files.
#[derive(Debug, thiserror::Error)]
#[error("--path is the path of the script on standard input, and nothing else may be checked then")]
struct PathOfFiles;

impl Problem for PathOfFiles {
    fn help(&self) -> Option<String> {
        Some("`bbz check - --path FILE.bzz` reads the script from standard input".to_owned())
    }
}

/// Carries out the command.
pub fn execute(arguments: &CheckArguments) -> Result<ExitStatus, Box<dyn Problem>> {
    let is_input = |files: &[PathBuf]| matches!(files, [file] if program::is_standard_input(file));
    if arguments.path.is_some() && !is_input(&arguments.files) {
        return Err(PathOfFiles.into());
    }
    let selection = arguments.selection.select()?;
    let mut found =
        CheckReport { objects: Vec::new(), errors: 0, warnings: 0, denied: 0, first: None };
    for path in &arguments.files {
        check(path, arguments, &selection, &mut found)?;
    }
    if arguments.json {
        let CheckReport { objects, errors, warnings, .. } = &found;
        output::write(&format!("{}\n", json::messages(objects, *errors, *warnings)))?;
    } else {
        found.print_summary();
    }
    if found.denied > 0 && !arguments.json {
        let (count, are) = (
            report::counted(found.denied, "warning"),
            if found.denied == 1 { "is" } else { "are" },
        );
        let title = format!("{count} {are} denied by `--deny`");
        report::print(Group::with_title(Level::ERROR.primary_title(title)));
    }
    Ok(if found.errors + found.denied == 0 {
        ExitStatus::Success
    } else {
        ExitStatus::CompileError
    })
}

fn check(
    path: &Path,
    arguments: &CheckArguments,
    selection: &RobotChoice,
    found: &mut CheckReport,
) -> Result<(), Box<dyn Problem>> {
    let kind = InputKind::of(path)?;
    let compile = || match &arguments.path {
        Some(name) => Ok(program::compiled_from_input(name, &arguments.include, selection)),
        None => program::compiled(path, kind, &arguments.include, selection),
    };
    let mut compiled = compile()?;
    if arguments.fix {
        let mended = fix::mend(path, &compiled.sources, &compiled.diagnostics)?;
        if mended > 0 {
            let title = format!("{} mended", report::counted(mended, "mistake"));
            report::print(Group::with_title(Level::NOTE.primary_title(title)));
            compiled = compile()?;
        }
    }
    let Compiled { image, diagnostics, sources, .. } = compiled;
    if arguments.json {
        found.objects.extend(json::diagnostics(&sources, &diagnostics));
    } else {
        report::diagnostics(&sources, &diagnostics);
    }
    found.count(&diagnostics, &arguments.deny);
    if let (Some(image), Some(robot)) = (image, &selection.robot) {
        fit::verify(&image, selection.effective_profile(), robot)
            .map_err(|cause| RefusedImage::new(path, cause))?;
    }
    Ok(())
}

impl CheckReport {
    fn count(&mut self, diagnostics: &[Diagnostic], deny: &[Denied]) {
        let (errors, warnings) = report::count(diagnostics);
        self.errors += errors;
        self.warnings += warnings;
        let is_denied = |diagnostic: &&Diagnostic| {
            diagnostic.severity() == Severity::Warning
                && deny.iter().any(|denied| match denied {
                    Denied::Warnings => true,
                    Denied::Code(code) => *code == diagnostic.code,
                })
        };
        self.denied += diagnostics.iter().filter(is_denied).count();
        // Keeps the first code of the highest severity.
        for code in diagnostics.iter().map(|diagnostic| diagnostic.code) {
            if self.first.is_none_or(|first| first.severity() < code.severity()) {
                self.first = Some(code);
            }
        }
    }

    /// Prints the number of messages, and the command that explains the first one.
    fn print_summary(&self) {
        // Without messages there is nothing to sum up.
        let Some(first) = self.first else { return };
        let counts = [(self.errors, "error"), (self.warnings, "warning")];
        let parts = counts.into_iter().filter(|(count, _)| *count > 0);
        let parts: Vec<String> = parts.map(|(count, noun)| report::counted(count, noun)).collect();
        let title = format!("{}; `bbz explain {}` explains", parts.join(" and "), first.text());
        report::print(Group::with_title(Level::NOTE.primary_title(title)));
    }
}
