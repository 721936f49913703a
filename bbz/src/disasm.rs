//! `bbz disasm`: prints an image or an object file as readable text.

use std::path::PathBuf;

use bittybuzz_compiler::bo;
use bittybuzz_compiler::disasm::disassemble;
use clap::Args;

use crate::exit::ExitStatus;
use crate::output;
use crate::problem::Problem;
use crate::program::{self, InputError, InputKind, LoadedProgram};
use crate::selection::SelectionArguments;

const EXAMPLES: &str = "\
Examples:
  bbz disasm hello.bzz                   what the script compiles to
  bbz disasm hello.bzz --profile tiny    with 16-bit numbers
  bbz disasm hello.bbi                   an image, with names from the .sym file beside it
  bbz disasm hello.bo                    an object file: Buzz's own instructions, which messages about it name";

/// Arguments of `bbz disasm`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct DisasmArguments {
    /// Script (.bzz), Buzz object file (.bo) or image (.bbi)
    file: PathBuf,
    #[command(flatten)]
    selection: SelectionArguments,
    /// Folder to search for included files; may be given several times
    #[arg(short = 'I', value_name = "DIR")]
    include: Vec<PathBuf>,
}

/// Carries out the command.
pub fn execute(arguments: &DisasmArguments) -> Result<ExitStatus, Box<dyn Problem>> {
    let selection = arguments.selection.select()?;
    if InputKind::of(&arguments.file)? == InputKind::Object {
        let listing = bo::disassemble(&program::read(&arguments.file)?);
        let path = arguments.file.clone();
        output::write(&listing.map_err(|error| InputError::Object { path, error })?)?;
        return Ok(ExitStatus::Success);
    }
    let opened = LoadedProgram::open(&arguments.file, &arguments.include, &selection)?;
    let Some(program) = opened else { return Ok(ExitStatus::CompileError) };
    output::write(&disassemble(&program.image, program.symbols.as_ref()))?;
    Ok(ExitStatus::Success)
}
