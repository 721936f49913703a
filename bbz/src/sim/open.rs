//! A scenario with its scripts, compiled once for each kind of robot that runs them.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use bittybuzz_arena::robot::RobotModel;
use bittybuzz_arena::run;
use bittybuzz_arena::scenario::{Scenario, ScenarioError};
use bittybuzz_compiler::refusal;
use bittybuzz_live::programs;

use crate::emulator;
use crate::messages;
use crate::problem::Problem;
use crate::program::LoadedProgram;
use crate::report;
use crate::selection::RobotChoice;
use crate::whole_file::Inputs;

use super::arguments::SimArguments;
use super::plan::ParameterPlaces;
use super::source::{self, ScenarioText};

/// `--emulator` names one program, but the robots need several.
#[derive(Debug, thiserror::Error)]
#[error("the robots of this scenario need several emulators, not the one of --emulator")]
struct SeveralEmulators;

impl Problem for SeveralEmulators {
    fn help(&self) -> Option<String> {
        Some("without --emulator they are searched next to this program, and in PATH".to_owned())
    }
}

/// A scenario and its programs.
pub struct Opened {
    pub path: PathBuf,
    /// The text of the scenario.
    #[cfg(feature = "view")]
    pub text: String,
    pub scenario: Arc<Scenario>,
    /// The programs for messages, in the order of [`Scenario::programs`].
    pub programs: Vec<Arc<LoadedProgram>>,
    /// The programs for the robots, in the same order.
    pub images: Arc<[run::Program]>,
    /// The places of parameters, for messages.
    places: ParameterPlaces,
    /// Programs that emulate robots, by the models' names.
    emulators: Vec<(&'static str, PathBuf)>,
}

/// Reads a scenario with settings, and compiles its scripts. Prints mistakes, those in settings at
/// `places`, and returns `None` if there are any.
pub fn open(
    arguments: &SimArguments,
    set: &[String],
    places: &ParameterPlaces,
) -> Result<Option<Opened>, Box<dyn Problem>> {
    let SimArguments { include, .. } = arguments;
    let ScenarioText { path, text } = source::read(arguments)?;
    let folder = path.parent().expect("a path of a file that was read has a name");
    let scenario = match Scenario::parse(
        &text,
        &path.to_string_lossy(),
        folder,
        set,
        &bittybuzz_robot_models::all(),
    ) {
        Ok(scenario) => scenario,
        Err(errors) => {
            print(&places.locate(errors));
            return Ok(None);
        }
    };
    for warning in bittybuzz_live::scenario_warnings(&text, &path.to_string_lossy(), &scenario) {
        report::doubt(&warning.message, &warning.place, warning.help);
    }
    // The mistakes of a script that many groups share are printed once.
    let programs = programs(&scenario, |group, script| -> Result<_, Box<dyn Problem>> {
        let program = match script {
            Some(script) => LoadedProgram::open(script, include, &RobotChoice::of_group(group))?,
            None => Some(LoadedProgram::empty(group)),
        };
        Ok(program.map(shared))
    })?;
    let Some(programs) = programs.into_iter().collect::<Option<Vec<SharedProgram>>>() else {
        return Ok(None);
    };
    let (programs, images): (Vec<_>, Vec<_>) = programs.into_iter().unzip();
    let images = images.into();
    let models = run::emulated(&scenario);
    if arguments.emulator.is_some() && models.len() > 1 {
        return Err(SeveralEmulators.into());
    }
    let named = arguments.emulator.as_deref();
    let program = |model: &Arc<dyn RobotModel>| {
        let emulation = model.emulation().expect("a scenario with firmware has an emulator for it");
        (model.name(), emulator::program(named, emulation.program()))
    };
    let emulators = models.iter().map(program).collect();
    Ok(Some(Opened {
        path,
        #[cfg(feature = "view")]
        text,
        scenario: Arc::new(scenario),
        programs,
        images,
        places: places.clone(),
        emulators,
    }))
}

/// A program of this tool, and the same program for the simulator.
type SharedProgram = (Arc<LoadedProgram>, run::Program);

fn shared(program: LoadedProgram) -> SharedProgram {
    let LoadedProgram { image, symbols, sources, .. } = &program;
    let sources = sources.clone().unwrap_or_default();
    let image = run::Program::new(image.clone(), symbols.clone(), sources);
    (Arc::new(program), image)
}

impl Opened {
    /// Returns the files that were read, and those that are read when robots are emulated.
    pub fn inputs(&self) -> Inputs {
        let mut inputs = Inputs::default();
        inputs.add(&self.path);
        for ((group, script), program) in self.scenario.programs().zip(&self.programs) {
            script.into_iter().for_each(|script| program.add_inputs(script, &mut inputs));
            group.robot_file.iter().for_each(|file| inputs.add(file));
            group.backend.firmware().into_iter().for_each(|image| inputs.add(image));
        }
        let bridge = self.scenario.bridge.iter().filter_map(|bridge| bridge.image.as_ref());
        bridge.for_each(|image| inputs.add(image));
        inputs
    }

    /// Returns a line per long message of each group of robots, with its share of the air.
    pub fn long_messages(&self) -> Vec<String> {
        let programs = self.scenario.programs().zip(&self.programs);
        let lines = programs.flat_map(|((group, _), program)| {
            let sources = program.sources.iter();
            sources.flat_map(|sources| {
                messages::of_group(&program.messages, sources, group, &self.scenario.media)
            })
        });
        lines.collect()
    }

    /// Returns the programs that emulate the robots: paths, or names that are found through PATH.
    pub fn emulator_programs(&self) -> impl Iterator<Item = &Path> {
        self.emulators.iter().map(|(_, program)| program.as_path())
    }

    /// Returns the data that all runs share. Prints mistakes, and returns `None` if there are any.
    pub fn setup(&self) -> Option<run::Setup> {
        match run::Setup::new(self.scenario.clone(), self.images.clone()) {
            Ok(setup) => {
                let named = self.emulators.iter().cloned();
                Some(named.fold(setup, |setup, (model, path)| setup.emulated_by(model, path)))
            }
            Err(run::SetupError::Scenario(errors)) => {
                print(&self.places.locate(errors));
                None
            }
            Err(run::SetupError::Refused { program, cause }) => {
                let refused = self.scenario.programs().nth(program.0);
                let (group, script) = refused.expect("the setup has the programs of the scenario");
                let script = script.expect("the machine accepts a program without a script");
                let message = format!("`{}` {}", script.display(), refusal::sentence(&cause));
                report::mistake(&message, Some(&group.place), None);
                None
            }
        }
    }
}

/// Prints the mistakes of a scenario.
pub fn print(errors: &[ScenarioError]) {
    for error in errors {
        report::mistake(&error.to_string(), error.place.as_deref(), error.help());
    }
}
