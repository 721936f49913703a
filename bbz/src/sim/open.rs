//! A scenario with its scripts, compiled once for each kind of robot that runs them.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use bittybuzz_arena::robot::{ProgramId, RobotModel};
use bittybuzz_arena::run;
use bittybuzz_arena::scenario::{Scenario, ScenarioError};
use bittybuzz_compiler::refusal;
use bittybuzz_toml_reader::Place;
use bittybuzz_vm_core::ImageError;

use crate::emulator;
use crate::messages;
use crate::problem::Problem;
use crate::program::LoadedProgram;
use crate::report;
use crate::whole_file::Inputs;

use super::arguments::SimArguments;
use super::plan::ParameterPlaces;
use super::programs::{Programs, SharedProgram};
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

/// A reason why a scenario with some settings cannot be run.
pub enum Unopened {
    /// Its mistakes.
    Scenario(Vec<ScenarioError>),
    /// Mistakes of a script, which were printed.
    Script,
    /// A script that the machine refuses.
    Refused(Refusal),
    Problem(Box<dyn Problem>),
}

impl<P: Into<Box<dyn Problem>>> From<P> for Unopened {
    fn from(problem: P) -> Self {
        Unopened::Problem(problem.into())
    }
}

impl Unopened {
    /// Prints the mistakes. The result is a problem with the command line or the files.
    pub fn print(self) -> Result<(), Box<dyn Problem>> {
        match self {
            Unopened::Scenario(errors) => print(&errors),
            Unopened::Script => {}
            Unopened::Refused(refusal) => refusal.print(),
            Unopened::Problem(problem) => return Err(problem),
        }
        Ok(())
    }
}

/// Reads a scenario with settings, and compiles its scripts. Prints mistakes, and returns `None` if there
/// are any.
pub fn open(arguments: &SimArguments, set: &[String]) -> Result<Option<Opened>, Box<dyn Problem>> {
    let text = source::read(arguments)?;
    let (places, programs) = (ParameterPlaces::default(), Programs::default());
    match open_text(arguments, &text, set, &places, &programs) {
        Ok(opened) => {
            opened.print_warnings(&text.text);
            Ok(Some(opened))
        }
        Err(unopened) => unopened.print().map(|()| None),
    }
}

/// Parses the text of a scenario with settings, and compiles its scripts or finds them in `programs`.
/// Mistakes in settings are those of their `places`.
pub fn open_text(
    arguments: &SimArguments,
    ScenarioText { path, text }: &ScenarioText,
    set: &[String],
    places: &ParameterPlaces,
    programs: &Programs,
) -> Result<Opened, Unopened> {
    let scenario = source::parse(path, text, set);
    let scenario = scenario.map_err(|errors| Unopened::Scenario(places.locate(errors)))?;
    // The mistakes of a script that many groups share are printed once.
    let programs = bittybuzz_live::programs(&scenario, |group, script| {
        programs.get(script, group, &arguments.include)
    })?;
    let programs: Option<Vec<SharedProgram>> = programs.into_iter().collect();
    let (programs, images): (Vec<_>, Vec<_>) =
        programs.ok_or(Unopened::Script)?.into_iter().unzip();
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
    Ok(Opened {
        path: path.clone(),
        #[cfg(feature = "view")]
        text: text.clone(),
        scenario: Arc::new(scenario),
        programs,
        images,
        places: places.clone(),
        emulators,
    })
}

impl Opened {
    /// Returns the files that were read, and those that are read when robots are emulated.
    pub fn inputs(&self) -> Inputs {
        let mut inputs = Inputs::default();
        self.add_inputs(&mut inputs);
        inputs
    }

    /// Adds the files that were read, and those that are read when robots are emulated.
    pub fn add_inputs(&self, inputs: &mut Inputs) {
        inputs.add(&self.path);
        for ((group, script), program) in self.scenario.programs().zip(&self.programs) {
            script.into_iter().for_each(|script| program.add_inputs(script, inputs));
            group.robot_file.iter().for_each(|file| inputs.add(file));
            group.backend.firmware().into_iter().for_each(|image| inputs.add(image));
        }
        let bridge = self.scenario.bridge.iter().filter_map(|bridge| bridge.image.as_ref());
        bridge.for_each(|image| inputs.add(image));
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

    /// Prints the warnings about parts of the scenario that change nothing.
    pub fn print_warnings(&self, text: &str) {
        let path = self.path.to_string_lossy();
        for warning in bittybuzz_live::scenario_warnings(text, &path, &self.scenario) {
            report::doubt(&warning.message, &warning.place, warning.help);
        }
    }

    /// Returns the data that all runs share. Prints mistakes, and returns `None` if there are any.
    pub fn setup(&self) -> Option<run::Setup> {
        match self.try_setup() {
            Ok(setup) => Some(setup),
            Err(run::SetupError::Scenario(errors)) => {
                print(&errors);
                None
            }
            Err(run::SetupError::Refused { program, cause }) => {
                self.refusal(program, &cause).print();
                None
            }
        }
    }

    /// Returns the message about an image that the machine refuses.
    pub fn refusal(&self, program: ProgramId, cause: &ImageError) -> Refusal {
        let refused = self.scenario.programs().nth(program.0);
        let (group, script) = refused.expect("the setup has the programs of the scenario");
        let script = script.expect("the machine accepts a program without a script");
        let message = format!("`{}` {}", script.display(), refusal::sentence(cause));
        Refusal { message, place: group.place.clone() }
    }

    /// Returns the data that all runs share. Mistakes in settings are those of their places.
    pub fn try_setup(&self) -> Result<run::Setup, run::SetupError> {
        let setup = run::Setup::new(self.scenario.clone(), self.images.clone());
        let setup = setup.map_err(|error| match error {
            run::SetupError::Scenario(errors) => {
                run::SetupError::Scenario(self.places.locate(errors))
            }
            refused => refused,
        })?;
        let named = self.emulators.iter().cloned();
        Ok(named.fold(setup, |setup, (model, path)| setup.emulated_by(model, path)))
    }
}

/// A message about a script that the machine refuses, and the place of its group.
pub struct Refusal {
    message: String,
    place: Place,
}

impl Refusal {
    fn print(self) {
        report::mistake(&self.message, Some(&self.place), None);
    }
}

/// Prints the mistakes of a scenario.
pub fn print(errors: &[ScenarioError]) {
    for error in errors {
        report::mistake(&error.to_string(), error.place.as_deref(), error.help());
    }
}
