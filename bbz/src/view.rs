//! `bbz view`: shows a recording in a page. `bbz sim --view` uses the same page.

use std::env;
use std::path::PathBuf;

use ::open as open_page;
use bittybuzz_arena::output::recording::RecordingError;
use bittybuzz_live::{Defect, Replay, Source};
use bittybuzz_page::{Page, PageError};
use bittybuzz_toml_reader::file;

use crate::exit::ExitStatus;
use crate::file_error::FileError;
use crate::interrupt::Interrupt;
use crate::output::{OutputError, ScriptOutput};
use crate::problem::Problem;
use crate::report;
use crate::shell;

/// A reason why nothing can be shown in a page.
#[derive(Debug, thiserror::Error)]
pub enum ViewError {
    /// A recording that cannot be read.
    #[error("cannot show `{path}`: {error}")]
    Recording {
        /// The path from the command line.
        path: PathBuf,
        error: RecordingError,
    },
    /// The page cannot be served.
    #[error("{0}")]
    Page(#[from] PageError),
}

impl Problem for ViewError {
    fn help(&self) -> Option<String> {
        match self {
            ViewError::Recording { error: RecordingError::NotARecording, .. } => {
                Some("`bbz sim SCENARIO.toml --record FILE` makes one".to_owned())
            }
            ViewError::Recording { .. } | ViewError::Page(_) => None,
        }
    }
}

const EXAMPLES: &str = "\
Examples:
  bbz sim swarm.toml --record swarm.bbr    make a recording
  bbz view swarm.bbr                       show it in the browser
  bbz view swarm.bbr --no-browser          only print the address of the page";

#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct ViewArguments {
    /// Recording of `bbz sim --record`
    recording: PathBuf,
    /// Print the address of the page and open no browser
    #[arg(long)]
    no_browser: bool,
}

/// Carries out the command.
pub fn execute(arguments: &ViewArguments) -> Result<ExitStatus, Box<dyn Problem>> {
    let path = &arguments.recording;
    let bytes = file::read(path, file::RECORDING_BYTES_MAX)
        .map_err(|error| FileError::reading(path, error))?;
    let mut replay =
        Replay::new(&bytes).map_err(|error| ViewError::Recording { path: path.clone(), error })?;
    show(&mut replay, arguments.no_browser)
}

/// Shows a session or a recording until its page is closed, or Ctrl-C.
pub fn show(source: &mut dyn Source, no_browser: bool) -> Result<ExitStatus, Box<dyn Problem>> {
    let mut interrupt = Interrupt::install()?;
    let page = Page::open().map_err(ViewError::Page)?;
    announce(&page, no_browser)?;
    let shown = page.show(source, || interrupt.is_raised(), &advice());
    Ok(ending(shown))
}

/// Returns the advice that a page shows about a defect.
pub fn advice() -> String {
    // The command alone does not repeat the requests of the page.
    format!("say what you did in the page; {}", Defect::advice(&shell::words(env::args_os())))
}

/// Prints the defect that ended a session, if one did, and returns the exit status.
pub fn ending(shown: Result<(), Defect>) -> ExitStatus {
    match shown {
        Ok(()) => ExitStatus::Success,
        Err(defect) => {
            report::defect(&defect);
            ExitStatus::Defect
        }
    }
}

/// Prints the address of a page and opens it.
pub fn announce(page: &Page, no_browser: bool) -> Result<(), OutputError> {
    let mut output = ScriptOutput::new();
    output.line(page.url().as_bytes());
    output.finish()?;
    if !no_browser {
        // If there is no browser, the printed address is enough.
        let _ = open_page::that_detached(page.url());
    }
    Ok(())
}
