//! The programs of scenarios that differ in settings alone.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use bittybuzz_arena::run;
use bittybuzz_arena::scenario::{EmbeddedFiles, Group};
use bittybuzz_compiler::check::outside::OutsideUses;
use bittybuzz_robot_spec::Robot;

use crate::problem::Problem;
use crate::program::LoadedProgram;
use crate::selection::RobotChoice;

/// A program of this tool, and the same program for the simulator.
pub type SharedProgram = (Arc<LoadedProgram>, run::Program);

/// Programs that were compiled before. Points of a sweep, of which there may be a million, share them.
#[derive(Default)]
pub struct Programs(Mutex<Vec<Known>>);

/// A program, and everything that it was made from.
struct Known {
    script: Option<PathBuf>,
    robot: Arc<Robot>,
    robots: Arc<[Robot]>,
    outside: Arc<OutsideUses>,
    embedded: Arc<EmbeddedFiles>,
    /// `None` if the script has mistakes, which were printed.
    program: Option<SharedProgram>,
}

impl Known {
    fn is_for(&self, script: Option<&Path>, group: &Group) -> bool {
        self.script.as_deref() == script
            && self.robot == group.robot
            && self.robots == group.robots_of_scenario
            && self.outside == group.outside
            && self.embedded == group.embedded
    }
}

impl Programs {
    /// Returns the program of a group: that of a script, or none for robots with firmware of their
    /// own. Prints the mistakes of the script at the first call, and returns `None` if there are any.
    pub fn get(
        &self,
        script: Option<&Path>,
        group: &Group,
        include: &[PathBuf],
    ) -> Result<Option<SharedProgram>, Box<dyn Problem>> {
        let mut known = self.0.lock().expect("a thread that compiles does not panic");
        if let Some(same) = known.iter().find(|known| known.is_for(script, group)) {
            return Ok(same.program.clone());
        }
        let program = match script {
            Some(script) => LoadedProgram::open(script, include, &RobotChoice::of_group(group))?,
            None => Some(LoadedProgram::empty(group)),
        };
        let program = program.map(shared);
        known.push(Known {
            script: script.map(Path::to_owned),
            robot: group.robot.clone(),
            robots: group.robots_of_scenario.clone(),
            outside: group.outside.clone(),
            embedded: group.embedded.clone(),
            program: program.clone(),
        });
        Ok(program)
    }
}

fn shared(program: LoadedProgram) -> SharedProgram {
    let LoadedProgram { image, symbols, sources, .. } = &program;
    let sources = sources.clone().unwrap_or_default();
    let image = run::Program::new(image.clone(), symbols.clone(), sources);
    (Arc::new(program), image)
}
