//! `bbz disasm`: an image as readable text.

use std::path::PathBuf;

use bittybuzz_compiler::disasm::disassemble;
use clap::Args;

use crate::Ending;
use crate::output;
use crate::problem::Problem;
use crate::program::{Kind, Program};
use crate::selection::SelectionArguments;

const EXAMPLES: &str = "\
Examples:
  bbz disasm hello.bzz                   what the script compiles to
  bbz disasm hello.bzz --profile tiny    with 16-bit numbers
  bbz disasm hello.bbi                   an image, with names from the .sym file beside it";

/// Arguments of `bbz disasm`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// Script (.bzz) or image (.bbi)
    file: PathBuf,
    #[command(flatten)]
    selection: SelectionArguments,
    /// Folder to search for included files; may be given several times
    #[arg(short = 'I', value_name = "DIR")]
    include: Vec<PathBuf>,
}

/// Carries out the command.
pub fn execute(arguments: &Arguments) -> Result<Ending, Problem> {
    let kind = Kind::of(&arguments.file)?;
    let selection = arguments.selection.select()?;
    let program = match kind {
        Kind::Script => {
            let compiled = Program::compile(&arguments.file, &arguments.include, &selection)?;
            let Some(program) = compiled else { return Ok(Ending::CompileError) };
            program
        }
        Kind::Image => Program::load(&arguments.file, &selection)?,
    };
    output::write(&disassemble(&program.image, program.symbols.as_ref()))?;
    Ok(Ending::Success)
}
