//! `bbz completions`: the script by which a shell completes command lines.

use clap::{Args, Command};
use clap_complete::{Shell, generate};

use crate::exit::ExitStatus;
use crate::output::{self, OutputError};

const EXAMPLES: &str = "\
Examples:
  bbz completions bash > ~/.local/share/bash-completion/completions/bbz
  bbz completions zsh > ~/.zfunc/_bbz    with ~/.zfunc in $fpath
  bbz completions fish > ~/.config/fish/completions/bbz.fish";

/// Arguments of `bbz completions`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct CompletionsArguments {
    /// The shell that reads the script
    shell: Shell,
}

/// Prints the script for a command line.
pub fn execute(
    arguments: &CompletionsArguments,
    mut command: Command,
) -> Result<ExitStatus, OutputError> {
    let mut script = Vec::new();
    let name = command.get_name().to_owned();
    generate(arguments.shell, &mut command, name, &mut script);
    output::write(&String::from_utf8_lossy(&script))?;
    Ok(ExitStatus::Success)
}
