//! One run, shown in a page.

use std::sync::Arc;

use bittybuzz_arena::run::{Session, Simulation};
use bittybuzz_live::{Live, Workshop};

use crate::Ending;
use crate::problem::Problem;
use crate::view;

use super::Arguments;
use super::desk::Desk;
use super::open;

/// The greatest number of copies for ways back: 2 GB with 20,000 robots.
const COPIES: usize = 32;

/// Shows a scenario until the page is closed, or Ctrl-C.
pub fn run(arguments: &Arguments, set: &[String]) -> Result<Ending, Problem> {
    let Some(opened) = open::open(arguments, set)? else { return Ok(Ending::CompileError) };
    let Some(setup) = opened.setup() else { return Ok(Ending::CompileError) };
    let desk = Desk::new(&arguments.scenario, set, &arguments.include, arguments.edit);
    let setup = Arc::new(setup.with_compiler(desk.compiler()));
    let seed = arguments.seed.unwrap_or(opened.scenario.world.seed);
    let simulation = match Simulation::new(setup, seed, 0) {
        Ok(simulation) => simulation,
        Err(error) => {
            open::print(&[error]);
            return Ok(Ending::CompileError);
        }
    };
    let text = replay_note(arguments.seed, set) + &opened.text;
    let mut live = Live::new(Session::new(simulation, COPIES), text).with_workshop(desk);
    view::show(&mut live, arguments.no_browser)
}

/// Returns a comment for a saved scenario if its text alone does not replay the session.
fn replay_note(seed: Option<u32>, set: &[String]) -> String {
    let seed = seed.map(|seed| format!(" --seed {seed}")).unwrap_or_default();
    let set: String = set.iter().map(|one| format!(" --set '{one}'")).collect();
    let options = seed + &set;
    if options.is_empty() {
        return options;
    }
    format!("# A session that was started with{options}: the same options replay it.\n\n")
}
