//! `bbz sweep view`: a run in the page. `bbz sweep report --view` opens runs in the same way.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Sender, channel};
use std::thread;
use std::time::Duration;

use bittybuzz_page::{LinkedDocument, Page};
use clap::Args;

use crate::exit::ExitStatus;
use crate::interrupt::Interrupt;
use crate::problem::Problem;
use crate::report;
use crate::view::{self, Opening, ViewError};

use super::super::arguments::SimArguments;
use super::super::experiment;
use super::super::runs::Runs;
use super::super::study::Study;
use super::folder;

/// The time after which the state of the browser is looked at again.
const PULSE: Duration = Duration::from_millis(50);

/// A run that the plan does not have.
#[derive(Debug, thiserror::Error)]
#[error("there is no run {run}: the plan has runs 0 to {}", .runs - 1)]
struct NoRun {
    run: usize,
    runs: usize,
}

impl Problem for NoRun {}

/// Arguments of `bbz sweep view`.
#[derive(Debug, Args)]
pub struct ViewArguments {
    /// Folder of `bbz sweep plan`
    folder: PathBuf,
    /// Number of the run, as in the report
    run: usize,
    /// Print the address of the page and open no browser
    #[arg(long)]
    no_browser: bool,
}

/// Carries out the command.
pub fn execute(arguments: &ViewArguments) -> Result<ExitStatus, Box<dyn Problem>> {
    let store = folder::open(&arguments.folder)?;
    let runs = experiment::runs(store.plan());
    if arguments.run >= runs.count() {
        return Err(NoRun { run: arguments.run, runs: runs.count() }.into());
    }
    let sim = folder::arguments(&arguments.folder, store.plan());
    // The run must be the one of the sweep.
    if folder::shown_study(&sim, &store)?.is_none() {
        return Ok(ExitStatus::CompileError);
    }
    let (mut sim, settings) = of_run(&sim, &runs, arguments.run);
    sim.no_browser = arguments.no_browser;
    super::super::view::run(&sim, &settings)
}

/// Returns the arguments and the settings of a run.
fn of_run(sim: &SimArguments, runs: &Runs, run: usize) -> (SimArguments, Vec<String>) {
    let seed = Some(runs.seed(run));
    let sim = SimArguments::of_sweep(sim.scenario.clone(), sim.include.clone(), seed);
    let mut settings = runs.settings(runs.point_of(run));
    // The seed of the run is that of the point already.
    settings.retain(|setting| !setting.starts_with(&format!("{}=", super::super::SEED)));
    (sim, settings)
}

/// Shows a report in the browser until Ctrl-C. Its links open runs.
pub fn serve(
    html: String,
    study: &Study,
    no_browser: bool,
) -> Result<ExitStatus, Box<dyn Problem>> {
    let mut interrupt = Interrupt::install()?;
    let is_interrupted = interrupt.flag();
    let document = LinkedDocument::open(html).map_err(ViewError)?;
    let mut opening = Opening::begin(document.url(), no_browser)?;
    let mut sessions = Vec::new();
    while !interrupt.is_raised() {
        opening.attend(document.was_opened())?;
        let Some(asked) = document.asked(PULSE) else { continue };
        let (run, runs) = (asked.number, study.runs.count());
        if run >= runs {
            asked.answer(Err(NoRun { run, runs }.to_string()));
            continue;
        }
        let (sim, settings) = of_run(study.arguments, &study.runs, run);
        let (sender, address) = channel();
        let flag = Arc::clone(&is_interrupted);
        sessions.push(thread::spawn(move || session(&sim, &settings, &sender, &flag)));
        let unopened = || "the run could not be opened: the terminal says why".to_owned();
        asked.answer(address.recv().map_err(|_| unopened()));
    }
    for session in sessions {
        session.join().expect("a session catches its defects");
    }
    Ok(ExitStatus::Success)
}

/// Shows a run until its page is closed, or Ctrl-C. Sends its address.
fn session(
    sim: &SimArguments,
    settings: &[String],
    address: &Sender<String>,
    is_interrupted: &AtomicBool,
) {
    let shown = || -> Result<(), Box<dyn Problem>> {
        let Some(mut live) = super::super::view::live(sim, settings)? else { return Ok(()) };
        let page = Page::open().map_err(ViewError)?;
        // The report waits for it.
        let _ = address.send(page.url().to_owned());
        let is_over = || is_interrupted.load(Ordering::Relaxed);
        view::ending(page.show(&mut live, is_over, &view::advice()));
        Ok(())
    };
    if let Err(problem) = shown() {
        report::problem(&*problem);
    }
}
