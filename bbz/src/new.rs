//! `bbz new`: writes a script, a scenario and a README that run.

use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use bittybuzz_robot_files::find;
use bittybuzz_robot_spec::{Parameter, Robot};
use clap::Args;

use crate::exit::ExitStatus;
use crate::file_error::FileError;
use crate::launch;
use crate::output;
use crate::problem::Problem;
use crate::whole_file;
use crate::world;

const EXAMPLES: &str = "\
Examples:
  bbz new flock --robot kilobot          a folder flock with flock.bzz, flock.toml and README.md
  bbz sim flock/flock.toml --view        then show it in a page

Exit status: 0, or 3 wrong command line or file.";

/// Arguments of `bbz new`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct NewArguments {
    /// Folder to make; its last part is the name of the files
    name: PathBuf,
    /// Robot: its name (see `bbz robots`) or the path of a robot file (*.toml)
    #[arg(long, value_name = "NAME|PATH.toml")]
    robot: String,
}

/// A folder that cannot be the new one.
#[derive(Debug, thiserror::Error)]
enum NewError {
    #[error("`{0}` exists already")]
    Exists(PathBuf),
    #[error("`{0}` names no folder to make")]
    NoName(PathBuf),
    #[error("`{0}` cannot be simulated: its file describes no body")]
    NoBody(String),
}

impl Problem for NewError {
    fn help(&self) -> Option<String> {
        let help = match self {
            NewError::Exists(_) | NewError::NoName(_) => {
                "give the name of a folder that does not exist, such as `flock`"
            }
            NewError::NoBody(_) => "give the robot file a [body] with a `drive`",
        };
        Some(help.to_owned())
    }
}

/// Carries out the command.
pub fn execute(arguments: &NewArguments) -> Result<ExitStatus, Box<dyn Problem>> {
    let folder = arguments.name.as_path();
    let name = folder.file_name().and_then(|name| name.to_str());
    let name = name.filter(|name| !name.contains(char::is_control));
    let name = name.ok_or_else(|| NewError::NoName(folder.to_owned()))?;
    let robot = find(&arguments.robot)?;
    let reference = world::reference(&arguments.robot, folder)
        .map_err(|error| FileError::reading(Path::new(&arguments.robot), error))?;
    if !world::is_simulated(&robot) {
        return Err(NewError::NoBody(robot.name).into());
    }
    make(folder)?;
    let script = format!("{name}.bzz");
    for (file, text) in [
        (script.clone(), script_text(&robot)),
        (format!("{name}.toml"), scenario_text(&robot, &reference, &script)),
        ("README.md".to_owned(), readme(name, &reference)),
    ] {
        whole_file::write(&folder.join(file), text.as_bytes())?;
    }
    let scenario = folder.join(format!("{name}.toml")).display().to_string();
    let next = launch::command(["sim", &scenario, "--view"]);
    output::write(&format!("made {}: try `{next}`\n", folder.display()))?;
    Ok(ExitStatus::Success)
}

/// Makes a folder, and those in which it is. Of two commands that make the same folder, one fails.
fn make(folder: &Path) -> Result<(), Box<dyn Problem>> {
    if let Some(parent) = folder.parent() {
        fs::create_dir_all(parent).map_err(|error| FileError::writing(parent, error))?;
    }
    match fs::create_dir(folder) {
        Ok(()) => Ok(()),
        Err(error) if error.kind() == ErrorKind::AlreadyExists => {
            Err(NewError::Exists(folder.to_owned()).into())
        }
        Err(error) => Err(FileError::writing(folder, error).into()),
    }
}

/// Returns true if `led(color)` of the robot takes the sum of 1 for red, 2 for green and 4 for blue.
fn has_led(robot: &Robot) -> bool {
    let is_color =
        |list: &Vec<Parameter>| matches!(&list[..], [color] if color.range == Some(0..=7));
    robot.functions.iter().any(|known| known.name == "led" && known.accepts.iter().any(is_color))
}

fn script_text(robot: &Robot) -> String {
    let (color, led) = match has_led(robot) {
        true => ("\n# Its color tells which one that is.", "\n  led(1 + greatest % 7)"),
        false => ("", ""),
    };
    if world::has_neighbors(robot) {
        format!(
            "\
# The robots find the greatest of their ids: each remembers the greatest that it has heard, and passes it on.{color}

function init() {{
  greatest = id
  neighbors.listen(\"greatest\", function(topic, value, robot) {{
    if(value > greatest) {{
      greatest = value
      log(\"heard of robot \", value)
    }}
  }})
}}

function step() {{
  neighbors.broadcast(\"greatest\", greatest){led}
}}
"
        )
    } else {
        "\
# The robot counts its steps.

function init() {
  count = 0
}

function step() {
  count = count + 1
  if(count % 10 == 0) log(count)
}
"
        .to_owned()
    }
}

fn scenario_text(robot: &Robot, reference: &str, script: &str) -> String {
    let scenario = world::scenario(robot, reference, script, world::COUNT);
    let expected = if world::has_neighbors(robot) {
        // Ids count from 0.
        format!(
            "# All robots agree on the greatest id.\n[[expect]]\nwithin = {}\n\
             value = \"global.greatest\"\nof = \"min\"\nequals = {}\n",
            world::SECONDS,
            world::COUNT - 1
        )
    } else {
        format!(
            "[[expect]]\nat = {}\nvalue = \"global.count\"\nof = \"min\"\nabove = 0\n",
            world::SECONDS
        )
    };
    let (count, kind) = (world::COUNT, &robot.name);
    format!(
        "# {count} robots of the kind {kind} run {script}.\n\n\
         # docs/scenario.md has all keys.\n{scenario}\n{expected}"
    )
}

/// Returns a README with the commands that a user needs next, from the new folder.
fn readme(name: &str, robot: &str) -> String {
    let (script, scenario) = (format!("{name}.bzz"), format!("{name}.toml"));
    let lines = [
        (launch::command(["check", &script, "--robot", robot]), "find mistakes"),
        (launch::command(["sim", &scenario]), "run the scenario, which is also a test"),
        (
            launch::command(["sim", &scenario, "--view"]),
            "watch it in a page, and change the script there",
        ),
        (launch::command(["robots", robot]), "the functions that a script can call"),
        (launch::command(["guide"]), "language, functions and commands as one page"),
    ];
    let width = lines.iter().map(|(command, _)| command.len()).max().unwrap_or(0);
    let lines = lines.map(|(command, purpose)| format!("{command:width$}  # {purpose}\n"));
    format!("# {name}\n\n```sh\n{}```\n", lines.concat())
}
