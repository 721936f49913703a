//! A session for the tests.

use std::path::Path;
use std::sync::Arc;

use bittybuzz_arena::run::{Program, Session, Setup, Simulation};
use bittybuzz_arena::scenario::{Group, Scenario};
use bittybuzz_compiler::compile::{Options, compile};
use bittybuzz_compiler::include::{IncludeLoader, MemoryFiles};
use bittybuzz_live::Live;

const SCENARIO: &str = "[world]\nsize = [500, 500]\nduration = 1000\n\
    [[robots]]\nrobot = \"kilobot\"\nscript = \"s.bzz\"\ncount = 3\n";

pub fn live() -> Live {
    let files = MemoryFiles::default().with("s.toml", SCENARIO).with("s.bzz", "");
    let models = bittybuzz_robot_models::all();
    let scenario = Scenario::open_in(&files, "s.toml".as_ref(), &[], &models).unwrap();
    let program = |(group, script): (&Group, &Path)| {
        let robots = bittybuzz_robot_files::all_shipped();
        let options = Options { robot: Some((*group.robot).clone()), robots, ..Options::default() };
        let script_text = "function step() { forward() }\n".to_owned();
        let compiled = compile(script, script_text, &IncludeLoader::new(&files), &options);
        let (symbols, sources) = (compiled.symbols, Arc::new(compiled.sources));
        Program::new(compiled.image.unwrap(), symbols, sources)
    };
    let programs: Vec<Program> = scenario.scripts().map(program).collect();
    let setup = Arc::new(Setup::new(scenario, programs).unwrap());
    let session = Session::new(Simulation::new(setup, 1, 1).unwrap(), 4);
    Live::new(session, SCENARIO.to_owned())
}
