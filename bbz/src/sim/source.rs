//! The text of the scenario that `bbz sim` runs: that of a file, or one made for a script.

use std::path::{Path, PathBuf};

use bittybuzz_arena::scenario::{Scenario, ScenarioError};
use bittybuzz_robot_files::find;
use bittybuzz_toml_reader::file;

use crate::file_error::FileError;
use crate::problem::Problem;
use crate::world;

use super::arguments::SimArguments;

/// The command line names a script without its robots, or robots without a script.
#[derive(Debug, thiserror::Error)]
enum SourceError {
    #[error("`{0}` is a script: name the robots that run it")]
    NoRobot(PathBuf),
    #[error("--robot is for a script, but `{0}` is a scenario, which names its robots itself")]
    RobotsOfScenario(PathBuf),
}

impl Problem for SourceError {
    fn help(&self) -> Option<String> {
        Some(match self {
            SourceError::NoRobot(script) => format!(
                "for example `bbz sim {} --robot NAME --count {}`, with a name of `bbz robots`; a scenario can say more, see docs/scenario.md",
                script.display(),
                world::COUNT
            ),
            SourceError::RobotsOfScenario(_) => {
                "`--set robots.0.count=20` changes the number of robots of the first group"
                    .to_owned()
            }
        })
    }
}

/// A scenario that was not parsed yet.
pub struct ScenarioText {
    /// The path of the file; that of a scenario for a script names no file.
    pub path: PathBuf,
    pub text: String,
}

/// Reads the scenario, or makes one for a script.
pub fn read(arguments: &SimArguments) -> Result<ScenarioText, Box<dyn Problem>> {
    let path = arguments.scenario.as_path();
    match (&arguments.robot, is_script(path)) {
        (Some(robot), true) => for_script(path, robot, arguments.count.unwrap_or(world::COUNT)),
        (None, true) => Err(SourceError::NoRobot(path.to_owned()).into()),
        (Some(_), false) => {
            file::open(path).map_err(|error| FileError::reading(path, error))?;
            Err(SourceError::RobotsOfScenario(path.to_owned()).into())
        }
        (None, false) => {
            // An unreadable file is a mistake of the command line; wrong content is a mistake of
            // the scenario.
            let text = file::read_text(path, file::TEXT_BYTES_MAX)
                .map_err(|error| FileError::reading(path, error))?;
            Ok(ScenarioText { path: path.to_owned(), text })
        }
    }
}

/// Parses the text of a scenario with settings.
pub fn parse(path: &Path, text: &str, set: &[String]) -> Result<Scenario, Vec<ScenarioError>> {
    let folder = path.parent().expect("a path of a file that was read has a name");
    Scenario::parse(text, &path.to_string_lossy(), folder, set, &bittybuzz_robot_models::all())
}

/// Returns true for a script or image, by its name.
pub fn is_script(path: &Path) -> bool {
    path.extension().is_some_and(|kind| ["bzz", "bo", "bbi"].iter().any(|script| kind == *script))
}

fn for_script(path: &Path, robot: &str, count: u32) -> Result<ScenarioText, Box<dyn Problem>> {
    file::open(path).map_err(|error| FileError::reading(path, error))?;
    let name = path.file_name().expect("a path of a file that was opened has a name");
    let name = name.to_string_lossy();
    let chosen = find(robot)?;
    let folder = path.parent().expect("a path of a file that was opened has a name");
    let reference = world::reference(robot, folder)
        .map_err(|error| FileError::reading(Path::new(robot), error))?;
    let text = world::scenario(&chosen, &reference, &name, count);
    Ok(ScenarioText { path: path.with_file_name(format!("<scenario for {name}>")), text })
}
