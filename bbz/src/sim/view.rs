//! One run, shown in a page.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use bittybuzz_arena::run::{self, Session, Simulation};
use bittybuzz_arena::scenario::Group;
use bittybuzz_compiler::render::{Color, Renderer};
use bittybuzz_live::Live;
use bittybuzz_robot_files::all_shipped;

use crate::Ending;
use crate::problem::Problem;
use crate::program::Program;
use crate::selection::Selection;
use crate::view;

use super::Arguments;
use super::open;

/// The greatest number of copies for ways back: 2 GB with 20,000 robots.
const COPIES: usize = 32;

/// Shows a scenario until the page is closed, or Ctrl-C.
pub fn run(arguments: &Arguments, set: &[String]) -> Result<Ending, Problem> {
    let Some(opened) = open::open(arguments, set)? else { return Ok(Ending::CompileError) };
    let Some(setup) = opened.setup() else { return Ok(Ending::CompileError) };
    let include = arguments.include.clone();
    let compiler = move |script: &Path, group: &Group| program(script, group, &include);
    let setup = Arc::new(setup.with_compiler(Arc::new(compiler)));
    let seed = arguments.seed.unwrap_or(opened.scenario.world.seed);
    let simulation = match Simulation::new(setup, seed, 0) {
        Ok(simulation) => simulation,
        Err(error) => {
            open::print(&[error]);
            return Ok(Ending::CompileError);
        }
    };
    let text = replay_note(arguments.seed, set) + &opened.text;
    let mut live = Live::new(Session::new(simulation, COPIES), text);
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

/// Compiles a script that a command loads. The error has all diagnostics of the script.
fn program(script: &Path, group: &Group, include: &[PathBuf]) -> Result<run::Program, String> {
    let robot = Some(group.robot.clone());
    let selection = Selection { robot, known: all_shipped(), profile: None };
    let mut errors = String::new();
    let program = Program::open_reporting(script, include, &selection, |sources, diagnostics| {
        let renderer = Renderer::new(sources);
        diagnostics.iter().for_each(|one| errors += &renderer.text(one, Color::Never));
        Ok(())
    });
    match program {
        Err(problem) => Err(problem.to_string()),
        Ok(None) => Err(errors),
        Ok(Some(program)) => Ok(run::Program { image: program.image, symbols: program.symbols }),
    }
}
