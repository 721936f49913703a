//! `bbz check`: what the compiler says about a script.

use std::path::PathBuf;

use bittybuzz_compiler::compile::Compiled;
use bittybuzz_compiler::fit;
use clap::Args;

use crate::Ending;
use crate::json;
use crate::output;
use crate::problem::Problem;
use crate::program::{self, Kind};
use crate::report;
use crate::selection::SelectionArguments;

const EXAMPLES: &str = "\
Examples:
  bbz check hello.bzz                    with the functions of every known robot
  bbz check hello.bzz --robot kilobot    can the Kilobot run it?
  bbz check hello.bzz --json             for editors and other programs

Exit status: 0, or 2 compile error, 3 wrong command line or file. Warnings do not change it.
`bbz explain CODE` explains a message.";

/// Arguments of `bbz check`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// Script (.bzz) or Buzz object file (.bo)
    file: PathBuf,
    #[command(flatten)]
    selection: SelectionArguments,
    /// Folder to search for included files; may be given several times
    #[arg(short = 'I', value_name = "DIR")]
    include: Vec<PathBuf>,
    /// Write the messages to standard output, as a JSON object
    #[arg(long)]
    json: bool,
}

/// Carries out the command.
pub fn execute(arguments: &Arguments) -> Result<Ending, Problem> {
    let kind = Kind::of(&arguments.file)?;
    let selection = arguments.selection.select()?;
    let Compiled { image, diagnostics, sources, .. } =
        program::compiled(&arguments.file, kind, &arguments.include, &selection)?;
    if arguments.json {
        output::write(&format!("{}\n", json::diagnostics(&sources, &diagnostics)))?;
    } else {
        report::diagnostics(&sources, &diagnostics);
    }
    if let (Some(image), Some(robot)) = (image, &selection.robot) {
        fit::verify(&image, selection.effective_profile(), robot)
            .map_err(|cause| Problem::refused(&arguments.file, cause))?;
    }
    let (errors, _) = report::count(&diagnostics);
    Ok(if errors == 0 { Ending::Success } else { Ending::CompileError })
}
