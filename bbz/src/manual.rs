//! `bbz manual`: the manual pages of all commands.

use std::path::PathBuf;

use clap::{Args, Command};

use crate::exit::ExitStatus;
use crate::file_error::FileError;

const EXAMPLES: &str = "\
Examples:
  bbz manual ~/.local/share/man/man1    then `man bbz-sim` shows a page";

/// Arguments of `bbz manual`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct ManualArguments {
    /// Existing folder for the pages: bbz.1, and one for each command
    #[arg(value_name = "FOLDER")]
    folder: PathBuf,
}

/// Writes the pages of a command line.
pub fn execute(arguments: &ManualArguments, command: Command) -> Result<ExitStatus, FileError> {
    let folder = &arguments.folder;
    let written = clap_mangen::generate_to(command.disable_help_subcommand(true), folder);
    written.map_err(|error| FileError::writing(folder, error))?;
    Ok(ExitStatus::Success)
}
