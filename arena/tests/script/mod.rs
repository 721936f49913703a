//! Scenarios with scripts, in a folder of the test's own.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use bittybuzz_arena::run::{Program, Setup, SetupError, Simulation, Summary};
use bittybuzz_arena::scenario::{Group, Scenario, ScenarioError};
use bittybuzz_compiler::compile::{Options, compile};
use bittybuzz_compiler::include::{DiskFiles, IncludeLoader};

/// Returns a folder with scripts, given by name and text. Each call returns another folder: a test that writes a script
/// empties the file first, and another test could read it at that moment.
pub fn folder(test: &str, scripts: &[(&str, &str)]) -> PathBuf {
    static CALLS: AtomicUsize = AtomicUsize::new(0);
    let call = CALLS.fetch_add(1, Ordering::Relaxed);
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{test}-{call}"));
    fs::create_dir_all(&folder).unwrap();
    for (name, text) in scripts {
        fs::write(folder.join(name), text).unwrap();
    }
    folder
}

/// A scenario of that folder, and its compiled scripts.
pub fn read(folder: &Path, text: &str) -> (Scenario, Vec<Program>) {
    let read = Scenario::parse(text, "test.toml", folder, &[], &bittybuzz_robot_models::all());
    let scenario = read.unwrap_or_else(|errors| panic!("{errors:#?}\n{text}"));
    let program = |(group, script): (&Group, &Path)| program(script, group).unwrap();
    let programs = scenario.scripts().map(program).collect();
    (scenario, programs)
}

/// Compiles a script for the robots of a group.
pub fn program(script: &Path, group: &Group) -> Result<Program, String> {
    let options = Options {
        robot: Some((*group.robot).clone()),
        robots: bittybuzz_robot_files::all_shipped(),
        profile: None,
        outside: (*group.outside).clone(),
    };
    let text = fs::read_to_string(script).map_err(|error| error.to_string())?;
    let compiled = compile(script, text, &IncludeLoader::new(&DiskFiles), &options);
    let (symbols, sources) = (compiled.symbols, Arc::new(compiled.sources));
    let program = compiled.image.map(|image| Program::new(image, symbols, sources));
    program.ok_or_else(|| format!("{:#?}", compiled.diagnostics))
}

/// Runs a scenario to its end, and shows the simulation after each tick.
pub fn run_with(
    folder: &Path,
    text: &str,
    threads: usize,
    mut look: impl FnMut(&mut Simulation),
) -> Summary {
    let (scenario, programs) = read(folder, text);
    let seed = scenario.world.seed;
    let setup = Arc::new(Setup::new(scenario, programs).unwrap());
    let mut simulation = Simulation::new(setup, seed, threads).unwrap();
    while !simulation.is_over() {
        simulation.tick().unwrap();
        look(&mut simulation);
    }
    simulation.summary()
}

/// Runs a scenario to its end.
pub fn run(folder: &Path, text: &str) -> Summary {
    run_with(folder, text, 1, |_| {})
}

/// What is wrong between a scenario and its scripts.
pub fn setup_errors(folder: &Path, text: &str) -> Vec<ScenarioError> {
    let (scenario, programs) = read(folder, text);
    match Setup::new(scenario, programs) {
        Err(SetupError::Scenario(errors)) => errors,
        Err(error) => panic!("{error:?}"),
        Ok(_) => Vec::new(),
    }
}
