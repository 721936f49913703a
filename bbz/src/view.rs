//! `bbz view`: shows a recording in a page. `bbz sim --view` uses the same page.

use std::path::PathBuf;

use ::open as open_page;
use bittybuzz_live::{Replay, Source};
use bittybuzz_page::Page;
use bittybuzz_toml_reader::file;

use crate::ExitStatus;
use crate::interrupt::Interrupt;
use crate::output::ScriptOutput;
use crate::problem::Problem;

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
pub fn execute(arguments: &ViewArguments) -> Result<ExitStatus, Problem> {
    let path = &arguments.recording;
    let bytes =
        file::read(path, file::MOST_RECORDING).map_err(|error| Problem::unreadable(path, error))?;
    let mut replay =
        Replay::new(&bytes).map_err(|error| Problem::Recording { path: path.clone(), error })?;
    show(&mut replay, arguments.no_browser)
}

/// Shows a session or a recording until its page is closed, or Ctrl-C.
pub fn show(source: &mut dyn Source, no_browser: bool) -> Result<ExitStatus, Problem> {
    let mut interrupt = Interrupt::install().map_err(Problem::Interrupt)?;
    let page = Page::open().map_err(Problem::Page)?;
    announce(&page, no_browser)?;
    page.show(source, || interrupt.is_raised());
    Ok(ExitStatus::Success)
}

/// Prints the address of a page and opens it.
pub fn announce(page: &Page, no_browser: bool) -> Result<(), Problem> {
    let mut output = ScriptOutput::new();
    output.line(page.url().as_bytes());
    output.finish()?;
    if !no_browser {
        // If there is no browser, the printed address is enough.
        let _ = open_page::that_detached(page.url());
    }
    Ok(())
}
