//! Shows a run in a page.

use std::sync::Arc;

use bittybuzz_arena::run::{Session, Simulation};
use bittybuzz_live::{Live, Workshop};

use crate::exit::ExitStatus;
use crate::problem::Problem;
use crate::view;

use super::arguments::{SEED, SimArguments};
use super::desk::Desk;
use super::unsaved::UnsavedFiles;
use super::{doors, open, values};

/// A value of `--set` that cannot be written into the text of the scenario.
#[derive(Debug, thiserror::Error)]
#[error("`--set {0}` has no place in the text of the scenario, which the page shows")]
struct NoPlace(String);

impl Problem for NoPlace {
    fn help(&self) -> Option<String> {
        Some("change it in the file".to_owned())
    }
}

/// The most copies of the simulation for going back in time: 2 GB with 20,000 robots.
const COPIES: usize = 32;

/// Shows a scenario until the page is closed, or Ctrl-C.
pub fn run(arguments: &SimArguments, set: &[String]) -> Result<ExitStatus, Box<dyn Problem>> {
    match live(arguments, set)? {
        Some(mut live) => view::show(&mut live, arguments.no_browser),
        None => Ok(ExitStatus::CompileError),
    }
}

/// Opens a scenario for a page. Prints mistakes, and returns `None` if there are any.
pub fn live(arguments: &SimArguments, set: &[String]) -> Result<Option<Live>, Box<dyn Problem>> {
    let Some(opened) = open::open(arguments, set)? else { return Ok(None) };
    let Some(setup) = opened.setup() else { return Ok(None) };
    // The page shows and saves the text with these values, because that is the one that runs.
    let seed = arguments.seed.map(|seed| format!("{SEED}={seed}"));
    let values = set.iter().chain(&seed).map(String::as_str);
    let text = values::put_all(&opened.text, values).map_err(NoPlace)?;
    let desk = Desk::for_page(&opened, &arguments.include, arguments.read_only);
    let setup = Arc::new(setup.with_compiler(desk.compiler()));
    let seed = arguments.seed.unwrap_or(opened.scenario.world.seed);
    let simulation = match Simulation::new(setup, seed, 0) {
        Ok(simulation) => simulation,
        Err(error) => {
            open::print(&[error]);
            return Ok(None);
        }
    };
    doors::print(&opened.scenario);
    let live = Live::new(Session::new(simulation, COPIES), text).with_workshop(desk);
    Ok(Some(live.with_unsaved(UnsavedFiles::new())))
}
