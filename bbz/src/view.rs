//! `bbz view`: shows a recording in a page. `bbz sim --view` uses the same page.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use ::open as open_page;
use bittybuzz_live::{Defect, Replay, Source};
use bittybuzz_page::{Page, PageError};
use bittybuzz_toml_reader::file;

use crate::exit::ExitStatus;
use crate::file_error::FileError;
use crate::interrupt::Interrupt;
use crate::launch;
use crate::output::{OutputError, ScriptOutput};
use crate::problem::Problem;
use crate::recording_error::RecordingProblem;
use crate::redirect::Redirect;
use crate::report;

/// The page cannot be served.
#[derive(Debug, thiserror::Error)]
#[error(transparent)]
pub struct ViewError(pub PageError);

impl Problem for ViewError {}

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
    let replay = Replay::new(&bytes).map_err(|error| RecordingProblem::new("show", path, error))?;
    let name = path.file_name().unwrap_or(path.as_os_str());
    let mut replay = replay.with_name(name.to_string_lossy().into_owned());
    show(&mut replay, arguments.no_browser)
}

/// The time after which the address of a page that no browser has opened is printed.
const PATIENCE: Duration = Duration::from_secs(5);

/// The longest time from Ctrl-C to the end of the command. The page has nothing that is not kept.
const ENDING: Duration = Duration::from_millis(700);

/// Shows a session or a recording until its page is closed, or Ctrl-C.
pub fn show(source: &mut dyn Source, no_browser: bool) -> Result<ExitStatus, Box<dyn Problem>> {
    let mut interrupt = Interrupt::install_ending_after(ENDING)?;
    let page = Page::open().map_err(ViewError)?;
    let mut opening = Opening::begin(page.url(), no_browser)?;
    let mut unprinted = None;
    let is_over = || {
        let attended = opening.attend(page.was_opened());
        unprinted = unprinted.take().or(attended.err());
        unprinted.is_some() || interrupt.is_raised()
    };
    let shown = page.show(source, is_over, &advice());
    unprinted.map_or(Ok(ending(shown)), |error| Err(error.into()))
}

/// Returns the advice that a page shows about a defect.
pub fn advice() -> String {
    // The command alone does not repeat the requests of the page.
    format!("say what you did in the page; {}", Defect::advice(&launch::command_line()))
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

/// A page that a browser is to open.
pub struct Opening {
    url: String,
    /// The file that leads the browser to the page, until it has.
    redirect: Option<Redirect>,
    /// The time at which the address is printed, if it was not printed yet.
    deadline: Option<Instant>,
}

impl Opening {
    /// Starts a browser with the page at an address, or else prints the address.
    pub fn begin(url: &str, no_browser: bool) -> Result<Self, OutputError> {
        let redirect = if no_browser { None } else { Redirect::new(url).ok() };
        let redirect = redirect.filter(|file| open_page::that_detached(file.path()).is_ok());
        let deadline = Some(Instant::now() + PATIENCE);
        let mut opening = Opening { url: url.to_owned(), redirect, deadline };
        if opening.redirect.is_none() {
            opening.print()?;
        }
        Ok(opening)
    }

    /// Removes the file once the page is open. Prints the address if the page is not open in time:
    /// the browser may not be allowed to read the file.
    pub fn attend(&mut self, was_opened: bool) -> Result<(), OutputError> {
        if was_opened {
            (self.redirect, self.deadline) = (None, None);
        }
        match self.deadline {
            Some(deadline) if Instant::now() >= deadline => self.print(),
            _ => Ok(()),
        }
    }

    fn print(&mut self) -> Result<(), OutputError> {
        self.deadline = None;
        let mut output = ScriptOutput::new();
        output.line(self.url.as_bytes());
        output.finish()
    }
}
