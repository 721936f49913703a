//! The mistakes of scenario files, each with its place and its remedy.

use std::fmt;

use bittybuzz_compiler::question::QuestionError;
use bittybuzz_robot_spec::{RobotError, SettingError};
use bittybuzz_toml_reader::{self as toml_reader, FileError, TomlError, one_of};

use crate::robot::step_rates;
use crate::sweep::RangeError;

/// A mistake in a scenario: a sentence (`Display`), and optionally a place and a remedy
/// ([`FileError::help`]).
pub type ScenarioError = FileError<ScenarioCause>;

/// A mistake, one variant for each cause.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ScenarioCause {
    /// The file cannot be read.
    Unreadable { path: String, reason: String },
    /// A mistake that any TOML file can have.
    Toml(TomlError),
    /// A key that has no meaning without another one.
    Without { key: &'static str, needs: &'static str },
    /// The file has no group of robots.
    NoRobots,
    /// The robot file has a mistake, or no robot has that name.
    Robot { error: Box<RobotError> },
    /// The script of a group does not exist.
    NoScript { path: String, reason: String, likely: Option<String> },
    /// A name of a group that is empty, or that selects other robots.
    BadGroupName { name: String },
    /// Two groups with one name.
    DuplicateGroup { name: String, line: usize },
    /// A name of an expectation or a measure that cannot be a column's name.
    BadColumnName { of: &'static str, name: String },
    /// Two expectations or two measures with one name.
    DuplicateColumn { of: &'static str, name: String, line: usize },
    /// A name of a measure that another column of the table of runs has.
    TakenColumn { name: String },
    /// Two `[[file]]` sections with one path.
    DuplicateFile { path: String, line: usize },
    /// Two robots with one id.
    DuplicateId { id: u32, line: usize },
    /// An id that exceeds 16 bits.
    IdsExhausted { last: u32 },
    /// A text that is neither a group, nor an id, nor a range of ids.
    UnknownRobots { text: String, groups: Vec<String> },
    /// No group has that name.
    UnknownGroup { name: String, groups: Vec<String> },
    /// An id that no robot has.
    UnknownId { id: String, groups: Vec<String> },
    /// A robot in two parts of a partition.
    TwoParts { id: u32 },
    /// A range of ids that is empty.
    EmptyRange { text: String },
    /// A robot outside the world.
    OutsideWorld { what: String, size: [u32; 2] },
    /// Two robots that overlap at the start: the id and place of each, the distance in mm between
    /// their middles that they need, and the key of the file that would separate them, with its
    /// least value.
    Overlap {
        robots: Box<[(u32, String); 2]>,
        apart: String,
        least: Option<(&'static str, String)>,
    },
    /// A body that reaches into a wall of the world, and the largest possible |x| and |y|.
    InWall { id: u32, at: String, radius: String, most: [String; 2] },
    /// A body that reaches into an obstacle.
    InObstacle { id: u32, at: String, radius: String },
    /// A box or a wall that robots would push.
    MovableNotDisc,
    /// A movable disc that reaches into something else at the start.
    MovableBarred { at: String, radius: String, barrier: String },
    /// A command to a run that has ended.
    RunIsOver,
    /// A time after the end of the run.
    AfterEnd { key: &'static str, duration: String },
    /// A time in seconds between two ticks, and the nearest times at ticks.
    BetweenTicks { key: String, value: String, nearest: [String; 2] },
    /// A quantity that does not exist.
    UnknownQuantity { text: String },
    /// No script of the robots has a global of that name.
    UnknownGlobal { name: String, known: Vec<String> },
    /// No script of the robots has a function of that name that an event could call.
    UnknownFunction { name: String },
    /// The robots cannot evaluate a question.
    Question { error: QuestionError },
    /// A comparison that needs a number has none.
    NotANumber { of: &'static str },
    /// A float for a global that begins as an integer: the line of the script where it does.
    FloatForInteger { name: String, value: String, script: String, line: u32 },
    /// A study without parameters.
    NoParameters,
    /// A key that cannot vary in a study.
    BadParameter { key: String },
    /// A range without values.
    BadRange { error: RangeError },
    /// Two parameters of a list with different numbers of values.
    UnlikeLists { keys: [String; 2], counts: [usize; 2] },
    /// A measure that is to be a number, of a quantity that each robot has.
    NoNumber { value: String },
    /// A quantity that needs the places of robots at a time at which the run does not keep them.
    PlacesNotKept { quantity: String },
    /// A key that combines the values of robots, for a quantity with a single value.
    OneNumber { key: &'static str },
    /// A medium that no robot of the scenario has.
    NoSuchMedium { medium: &'static str },
    /// A robot file that needs more than the simulator's virtual machine has.
    CapacityError { robot: String, needs: String },
    /// A robot file with steps that are not a whole number of ticks apart.
    StepRate { robot: String, rate: u32 },
    /// A robot without an emulator.
    NoEmulator { robot: String },
    /// Firmware is asked for in a build without the feature `emulators`.
    NoEmulators,
    /// A robot file that does not describe the robot's body.
    NoBody { robot: String, known: Vec<&'static str> },
    /// A function of a robot that has no effect in the simulator.
    NoEffect { robot: String, function: String },
    /// The firmware of these robots does not exist or cannot be used.
    NoFirmware { robots: &'static [&'static str], path: String, reason: String },
    /// An image for robots whose emulator gives them no body.
    NoImages { robot: String },
    /// The image of a group does not exist or cannot be used.
    NoImage { path: String, reason: String },
    /// A key without effect on robots that run a foreign image.
    NotWithImage { key: &'static str },
    /// A movement by hand of robots that fly in their emulator.
    NotMoved { key: &'static str },
    /// A door at a port that exceeds 16 bits.
    PortsExhausted { last: u32 },
    /// Two robots with doors at one port.
    DuplicateDoor { port: u32, line: usize },
    /// The door of a robot cannot be opened.
    NoDoor { robot: u16, reason: String },
    /// Emulated robots and robots in virtual machines of one model.
    UnlikeBackends { line: usize },
    /// Two groups of one model with different firmware.
    UnlikeFirmware { line: usize },
    /// A robot that the bridge does not reach.
    NotBridged,
    /// More robots than an emulator can run.
    TooManyEmulated { count: u32, most: u32 },
    /// More adversaries send at one time than are allowed. `at` is the time in seconds.
    TooManyAdversaries { at: String, max: usize },
    /// A key that emulated robots do not support.
    NotEmulated { key: &'static str },
    /// An event about poses from outside, for robots that get none.
    NoPoses { key: &'static str, group: String },
    /// Labels are exchanged of other than two robots of one group.
    NotTwoOfAGroup,
    /// A setting in flash that the robot does not take.
    Setting { error: Box<SettingError> },
    /// Settings in flash of robots whose model has none.
    NoSettings,
    /// A quantity that cannot be read from an emulated robot.
    Unseen { quantity: String },
    /// A command loads a script into a run that has no compiler.
    NoCompiler { script: String },
    /// The script of a command has errors, as the compiler reports them.
    NotCompiled { script: String, report: String },
    /// The robots' virtual machine rejects the script of a command.
    NotLoaded { script: String, reason: String },
    /// The script of a command was loaded before, and has changed since.
    ScriptChanged { script: String },
    /// The script gets no seal for the robot's flash, because its virtual machine would reject it.
    ScriptRefused { reason: String },
    /// The script is too long for the robot's flash.
    ScriptTooLong { bytes: usize, most: u32 },
    /// An emulated robot outside the projector's light.
    InTheDark { id: u16 },
    /// The emulator program does not exist.
    NoEmulatorProgram { program: String, reason: String },
    /// The emulator rejects the firmware.
    Emulator { message: String },
    /// The engine rejects the settings.
    Settings { message: String },
    /// More robots than random placement finds room for, with the number of robots that an empty
    /// grid would hold, and its spacing in mm.
    NoRoom { count: usize, placed: usize, grid: usize, spacing: String },
}

/// Returns the error of settings that are valid one by one, but not together.
pub(crate) fn settings_error(error: crate::engine::SettingsError) -> ScenarioError {
    ScenarioError { cause: ScenarioCause::Settings { message: error.to_string() }, place: None }
}

impl From<TomlError> for ScenarioCause {
    fn from(error: TomlError) -> Self {
        ScenarioCause::Toml(error)
    }
}

impl fmt::Display for ScenarioCause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ScenarioCause::Unreadable { path, reason } => {
                write!(f, "cannot read `{path}`: {reason}")
            }
            ScenarioCause::Toml(error) => error.fmt(f),
            ScenarioCause::Without { key, needs } => {
                write!(f, "`{key}` means nothing without `{needs}`")
            }
            ScenarioCause::NoRobots => write!(f, "the scenario has no robots"),
            ScenarioCause::Robot { error } => error.cause.fmt(f),
            ScenarioCause::NoScript { path, reason, .. } => {
                write!(f, "cannot read `{path}`: {reason}")
            }
            ScenarioCause::BadGroupName { name } => {
                write!(f, "\"{name}\" cannot be the name of a group")
            }
            ScenarioCause::DuplicateGroup { name, .. } => {
                write!(f, "a group `{name}` is defined a second time")
            }
            ScenarioCause::BadColumnName { of, name } => {
                write!(f, "{name:?} cannot be the name of {of}")
            }
            ScenarioCause::TakenColumn { name } => {
                write!(f, "the table of runs has a column `{name}` of its own")
            }
            ScenarioCause::DuplicateFile { path, .. } => {
                write!(f, "the file `{path}` stands here a second time")
            }
            ScenarioCause::DuplicateColumn { of, name, .. } => {
                write!(f, "{of} `{name}` is defined a second time")
            }
            ScenarioCause::DuplicateId { id, .. } => {
                write!(f, "robot {id} is defined a second time")
            }
            ScenarioCause::IdsExhausted { last } => {
                write!(f, "the last robot would have id {last}")
            }
            ScenarioCause::UnknownRobots { text, .. } => {
                write!(f, "no group of robots is named `{text}`")
            }
            ScenarioCause::UnknownGroup { name, .. } => {
                write!(f, "no group of robots is named `{name}`")
            }
            ScenarioCause::UnknownId { id, .. } => write!(f, "there is no robot {id}"),
            ScenarioCause::TwoParts { id } => write!(f, "robot {id} is in two parts"),
            ScenarioCause::EmptyRange { text } => write!(f, "no robot is in `{text}`"),
            ScenarioCause::OutsideWorld { what, .. } => {
                write!(f, "{what} would be outside the world")
            }
            ScenarioCause::Overlap { robots, .. } => {
                let [(one, at), (other, other_at)] = &**robots;
                write!(f, "robot {one} at {at} and robot {other} at {other_at} overlap")
            }
            ScenarioCause::InWall { id, at, .. } => {
                write!(f, "robot {id} at {at} would stand in the wall of the world")
            }
            ScenarioCause::InObstacle { id, at, .. } => {
                write!(f, "robot {id} at {at} would stand in an obstacle")
            }
            ScenarioCause::MovableNotDisc => write!(f, "only a disc can be movable"),
            ScenarioCause::MovableBarred { at, barrier, .. } => {
                write!(f, "the movable disc at {at} would stand in {barrier}")
            }
            ScenarioCause::RunIsOver => f.write_str("the run is over"),
            ScenarioCause::AfterEnd { key, .. } => write!(f, "`{key}` is not within the run"),
            ScenarioCause::BetweenTicks { key, value, .. } => {
                write!(f, "`{key}` cannot be {value}: the simulator has a tick each 0.1 s")
            }
            ScenarioCause::UnknownQuantity { text } => write!(f, "there is no quantity `{text}`"),
            ScenarioCause::UnknownGlobal { name, .. } => {
                write!(f, "no script has a global `{name}`")
            }
            ScenarioCause::UnknownFunction { name } => {
                write!(f, "no script of these robots has a function `{name}` to call")
            }
            ScenarioCause::Question { error } => error.fmt(f),
            ScenarioCause::NotANumber { of } => {
                write!(f, "\"{of}\" needs a comparison with a number")
            }
            ScenarioCause::FloatForInteger { name, value, script, line } => {
                write!(
                    f,
                    "`{name}` is an integer in line {line} of `{script}`, and {value} is a float"
                )
            }
            ScenarioCause::NoParameters => f.write_str("[sweep] has no parameter"),
            ScenarioCause::BadParameter { key } => write!(f, "`{key}` cannot vary"),
            ScenarioCause::BadRange { error } => error.fmt(f),
            ScenarioCause::UnlikeLists { keys: [one, other], counts: [count, other_count] } => {
                write!(f, "`{one}` has {count} values and `{other}` has {other_count}")
            }
            ScenarioCause::NoNumber { value } => {
                write!(
                    f,
                    "each robot has a `{value}`, but a measure without a comparison is one number"
                )
            }
            ScenarioCause::PlacesNotKept { quantity } => {
                write!(f, "`{quantity}` needs places of robots that this run does not keep")
            }
            ScenarioCause::OneNumber { key } => {
                write!(f, "`{key}` means nothing here: the robots have one number together")
            }
            ScenarioCause::NoSuchMedium { medium } => {
                write!(f, "no robot of the scenario has the medium `{medium}`")
            }
            ScenarioCause::CapacityError { robot, needs } => {
                write!(f, "`{robot}` cannot be simulated: its body needs {needs}")
            }
            ScenarioCause::StepRate { robot, rate } => {
                write!(
                    f,
                    "`{robot}` cannot be simulated: its file asks for {rate} steps per second"
                )
            }
            ScenarioCause::NoEmulators => {
                write!(
                    f,
                    "this program was built without emulators, so that no robot runs its firmware"
                )
            }
            ScenarioCause::NoEmulator { robot } => write!(f, "nothing emulates a `{robot}`"),
            ScenarioCause::NoBody { robot, .. } => {
                write!(f, "`{robot}` cannot be simulated: its file describes no body")
            }
            ScenarioCause::NoEffect { robot, function, .. } => {
                write!(f, "`{function}` of `{robot}` has no effect in the simulator")
            }
            ScenarioCause::NoFirmware { path, reason, .. } => {
                write!(f, "cannot use firmware `{path}`: {reason}")
            }
            ScenarioCause::NoImages { robot } => {
                write!(f, "a `{robot}` runs no foreign `image`")
            }
            ScenarioCause::NoImage { path, reason } => {
                write!(f, "cannot use the image `{path}`: {reason}")
            }
            ScenarioCause::NotWithImage { key } => {
                write!(f, "`{key}` has no effect on robots with an `image`")
            }
            ScenarioCause::NotMoved { key } => {
                write!(f, "`{key}` has no effect on robots that fly in their emulator")
            }
            ScenarioCause::PortsExhausted { last } => {
                write!(f, "the door of the last robot would have port {last}")
            }
            ScenarioCause::DuplicateDoor { port, .. } => {
                write!(f, "two robots would have a door at port {port}")
            }
            ScenarioCause::NoDoor { robot, reason } => {
                write!(f, "robot {robot} gets no door: {reason}")
            }
            ScenarioCause::UnlikeBackends { line } => {
                write!(
                    f,
                    "these robots and those of line {line} would not receive each other's messages"
                )
            }
            ScenarioCause::UnlikeFirmware { line } => {
                write!(f, "these robots run another firmware than those of line {line}")
            }
            ScenarioCause::NotBridged => {
                write!(f, "the bridge does not reach these robots, which run no firmware")
            }
            ScenarioCause::TooManyEmulated { count, most } => {
                write!(f, "{count} robots are too many for an emulator, which plays {most}")
            }
            ScenarioCause::TooManyAdversaries { at, max } => {
                write!(f, "more than {max} adversaries would send at {at} s")
            }
            ScenarioCause::NotEmulated { key } => {
                write!(f, "`{key}` cannot be had of robots that run firmware")
            }
            ScenarioCause::Setting { error } => error.fmt(f),
            ScenarioCause::NoSettings => {
                write!(f, "`settings` have no effect in this model of the robots")
            }
            ScenarioCause::NoPoses { key, group } => {
                write!(
                    f,
                    "`{key}` is about poses from outside, which the robots of `{group}` do not get"
                )
            }
            ScenarioCause::NotTwoOfAGroup => f.write_str(
                "`relabel` exchanges two robots of one group that are present from the start",
            ),
            ScenarioCause::Unseen { quantity } => {
                write!(f, "`{quantity}` cannot be seen of robots that run firmware")
            }
            ScenarioCause::ScriptTooLong { bytes, most } => {
                write!(f, "the script has {bytes} bytes, the robot has room for {most}")
            }
            ScenarioCause::ScriptRefused { reason } => write!(f, "the script {reason}"),
            ScenarioCause::NoCompiler { script } => {
                write!(f, "`{script}` cannot be loaded: nothing compiles scripts in this run")
            }
            ScenarioCause::NotCompiled { script, report } => {
                write!(f, "`{script}` cannot be loaded:\n{}", report.trim_end())
            }
            ScenarioCause::NotLoaded { script, reason } => write!(f, "`{script}` {reason}"),
            ScenarioCause::ScriptChanged { script } => {
                write!(f, "`{script}` has changed since it was loaded")
            }
            ScenarioCause::InTheDark { id } => {
                write!(f, "robot {id} would start where the projector does not shine")
            }
            ScenarioCause::NoEmulatorProgram { program, reason } => {
                write!(f, "cannot start the emulator `{program}`: {reason}")
            }
            ScenarioCause::Emulator { message } => {
                write!(f, "the robots cannot be emulated: {message}")
            }
            ScenarioCause::Settings { message } => write!(f, "the world cannot be made: {message}"),
            ScenarioCause::NoRoom { count, placed, .. } => {
                write!(f, "random placement found no room for {count} robots, only for {placed}")
            }
        }
    }
}

impl toml_reader::Cause for ScenarioCause {
    fn help(&self) -> Option<String> {
        match self {
            ScenarioCause::Toml(error) => error.help(),
            ScenarioCause::NoRobots => Some("write a [[robots]] section for each group of them".to_owned()),
            ScenarioCause::Robot { error } => error.cause.help(),
            ScenarioCause::NoScript { likely, .. } => {
                likely.as_ref().map(|likely| format!("did you mean `{likely}`?"))
            }
            ScenarioCause::BadGroupName { .. } => {
                Some("\"all\" means all robots, numbers mean ids; a word is needed".to_owned())
            }
            ScenarioCause::DuplicateGroup { line, .. } => {
                Some(format!("the first is in line {line}; choose another `name`"))
            }
            ScenarioCause::BadColumnName { .. } => Some(
                "use letters, digits and _, the first no digit, as in `name = \"all_agree\"`"
                    .to_owned(),
            ),
            ScenarioCause::DuplicateFile { line, .. } => {
                Some(format!("the first is in line {line}; leave out one of them"))
            }
            ScenarioCause::DuplicateColumn { line, .. } => {
                Some(format!("the first is in line {line}; choose another `name`"))
            }
            ScenarioCause::TakenColumn { .. } => Some("choose another `name`".to_owned()),
            ScenarioCause::DuplicateId { line, .. } => {
                Some(format!("the group in line {line} has it; choose another `first_id`"))
            }
            ScenarioCause::IdsExhausted { .. } => Some("ids are 0 to 65535".to_owned()),
            ScenarioCause::UnknownRobots { text, groups } => {
                let forms = "(also: \"all\", an id as 3, ids as \"3..7\", or a list of these)";
                Some(format!("{} {forms}", one_of(text, groups)))
            }
            ScenarioCause::UnknownGroup { name, groups } => Some(one_of(name, groups)),
            ScenarioCause::UnknownId { groups, .. } => Some(format!("there are {}", groups.join(", "))),
            ScenarioCause::EmptyRange { .. } => Some("\"3..7\" is 3, 4, 5, 6 and 7".to_owned()),
            ScenarioCause::OutsideWorld { size: [width, height], .. } => {
                Some(format!("the world is {width} mm by {height} mm, with (0, 0) in its middle"))
            }
            ScenarioCause::Overlap { apart, least, .. } => {
                let least = least.as_ref().map(|(key, least)| format!("; the least `{key}` is {least}"));
                Some(format!(
                    "their bodies need {apart} mm from middle to middle{}",
                    least.unwrap_or_default()
                ))
            }
            ScenarioCause::InWall { radius, most: [x, y], .. } => Some(format!(
                "its body has a radius of {radius} mm: x is from -{x} to {x}, y from -{y} to {y}"
            )),
            ScenarioCause::InObstacle { radius, .. } => Some(format!(
                "its body has a radius of {radius} mm, which must be between its middle and the obstacle"
            )),
            ScenarioCause::MovableNotDisc => Some(
                "replace its size by `at` and `radius`, or leave out `movable`: then it stands still"
                    .to_owned(),
            ),
            ScenarioCause::MovableBarred { radius, .. } => Some(format!(
                "its radius is {radius} mm: move it, or make one of both smaller"
            )),
            ScenarioCause::RunIsOver => Some("go back, or start the run again".to_owned()),
            ScenarioCause::AfterEnd { duration, .. } => {
                Some(format!("`duration` in [world] is {duration} s"))
            }
            ScenarioCause::BetweenTicks { nearest: [before, after], .. } => {
                Some(format!("{before} and {after} are the nearest that work"))
            }
            ScenarioCause::UnknownQuantity { text } => Some(quantity_help(text)),
            ScenarioCause::UnknownGlobal { name, known } if known.is_empty() => Some(format!(
                "the scripts of these robots have none, or images no symbols; a global is assigned outside of functions: `{name} = 0`"
            )),
            ScenarioCause::UnknownGlobal { name, known } => Some(one_of(name, known)),
            ScenarioCause::UnknownFunction { name } => Some(format!(
                "write `function {name}() {{ ... }}` in the script; images, and commands of a session, have only the functions that events of the scenario call"
            )),
            ScenarioCause::StepRate { .. } => {
                let rates: Vec<String> = step_rates().map(|rate| rate.to_string()).collect();
                Some(format!(
                    "the simulator has ten ticks per second, so `tick_hz` can be one of {}",
                    rates.join(", ")
                ))
            }
            ScenarioCause::NoRoom { count, grid, spacing, .. } => Some(match grid >= count {
                true => format!(
                    "make the world or `area` larger; or say placement = \"grid\" and spacing = {spacing}, which holds {grid} where \
                     nothing else stands"
                ),
                false => format!(
                    "make the world or `area` larger: even a grid with spacing = {spacing} holds only {grid}"
                ),
            }),
            ScenarioCause::NoBody { known, .. } => Some(format!(
                "give the robot file a [body] with a `drive`, or the group a `body`: {}",
                known.join(", ")
            )),
            ScenarioCause::NoEffect { function, .. } => Some(format!(
                "leave `{function}` out of the robot file, give the file a [body], which has `sets`, `reads` and `logs` for functions, \
                 or give the model of the robot an effect for it"
            )),
            ScenarioCause::NoEmulators => {
                Some("backend = \"vm\" simulates these robots; `bbz sim` also emulates them".to_owned())
            }
            ScenarioCause::NoEmulator { .. } => {
                Some("backend = \"vm\" simulates it; emulated are robots that ship, if their file says where their id is".to_owned())
            }
            ScenarioCause::NoFirmware { robots, .. } => Some(format!(
                "`cargo xtask build {}` builds it and says where it is; `firmware` names another one",
                robots.join("` or `cargo xtask build ")
            )),
            ScenarioCause::NoImages { .. } => Some(
                "`firmware` names another build of this project's firmware for the robot"
                    .to_owned(),
            ),
            ScenarioCause::NoImage { .. } => Some(
                "name the ELF file of a firmware for the robot's chip".to_owned(),
            ),
            ScenarioCause::NotWithImage { key: "script" } => Some(
                "leave out `script`, or leave out `image`: this project's firmware runs scripts"
                    .to_owned(),
            ),
            ScenarioCause::NotWithImage { key } | ScenarioCause::NotMoved { key } => {
                Some(format!("leave out `{key}`"))
            }
            ScenarioCause::PortsExhausted { .. } => {
                Some("ports are 1 to 65535; cflib looks for robots at 19850 to 19859".to_owned())
            }
            ScenarioCause::DuplicateDoor { line, .. } => Some(format!(
                "each robot has a port of its own, from `door` on; the other is in line {line}"
            )),
            ScenarioCause::NoDoor { .. } => Some(
                "choose another `door`, or end the program that uses the port".to_owned(),
            ),
            ScenarioCause::InTheDark { .. } => Some(
                "it lights 838 mm by 518 mm around the middle of the world; `area` keeps random places in there"
                    .to_owned(),
            ),
            ScenarioCause::NoEmulatorProgram { .. } => Some(
                "`cargo build --locked --release -p bittybuzz-emulate-m0` builds one, so does `-avr` or `-stm32`; it is looked for \
                 beside bbz and in PATH"
                    .to_owned(),
            ),
            ScenarioCause::UnlikeBackends { .. } => {
                Some("all robots of a kind in a world need the same `backend`".to_owned())
            }
            ScenarioCause::UnlikeFirmware { .. } => {
                Some("all of a kind that are emulated in a world need the same `firmware`, or the same `image`".to_owned())
            }
            ScenarioCause::NotBridged => Some("say backend = \"firmware\"".to_owned()),
            ScenarioCause::TooManyAdversaries { .. } => Some(
                "leave this one out, or let an earlier one end before with `until`".to_owned(),
            ),
            ScenarioCause::NotEmulated { .. } => {
                Some("backend = \"vm\" has it; emulated robots can be moved, fail, be restarted and cut off, and lose packets".to_owned())
            }
            ScenarioCause::Setting { error } => Some(error.help()),
            ScenarioCause::NoSettings => Some(
                "backend = \"firmware\" has them, and fidelity = \"flight\" those of a flight".to_owned(),
            ),
            ScenarioCause::NoPoses { .. } => Some(
                "fidelity = \"flight\" with positioning = \"capture\", \"lighthouse\" or \"loco\" has them"
                    .to_owned(),
            ),
            ScenarioCause::NotTwoOfAGroup => Some(
                "say relabel = [ID, ID]; of a group of more than 256 robots, two of the same 256".to_owned(),
            ),
            ScenarioCause::Unseen { .. } => Some(
                "place, heading, LED and whether the script runs can; or let the script show it with `led`"
                    .to_owned(),
            ),
            ScenarioCause::NoCompiler { .. } => {
                Some("an event of the scenario with `load` does the same".to_owned())
            }
            ScenarioCause::ScriptChanged { .. } => Some(
                "give the new script a name of its own: what was done before is written down with the old one"
                    .to_owned(),
            ),
            ScenarioCause::FloatForInteger { name, .. } => Some(format!(
                "write an integer; or, if the script computes with floats, begin there with `{name} = 1.0` or another number with a point"
            )),
            ScenarioCause::NoParameters => {
                Some("write a [[sweep.parameter]] with `key` and `values`".to_owned())
            }
            ScenarioCause::BadParameter { .. } => {
                Some("write a key of the scenario, such as key = \"medium.ir.loss\"".to_owned())
            }
            ScenarioCause::BadRange { .. } => {
                Some("write it as FIRST:LAST:STEP, for example \"1:9:2\"".to_owned())
            }
            ScenarioCause::UnlikeLists { .. } => {
                Some("design = \"list\" needs as many values of each; \"grid\" combines all".to_owned())
            }
            ScenarioCause::NoNumber { value } => Some(format!(
                "combine the values: of = \"mean\" or another word, or value = \"share({value} == 1)\"; or compare them, and get the first time at which it is true"
            )),
            ScenarioCause::PlacesNotKept { quantity } => Some(format!(
                "write `{quantity}` into `plot` of [output], or into a [[measure]]: a run keeps the places of the times that its scenario names"
            )),
            ScenarioCause::NotANumber { .. } => Some("equals, differs, below, above or between".to_owned()),
            ScenarioCause::Unreadable { .. }
            | ScenarioCause::Without { .. }
            | ScenarioCause::TwoParts { .. }
            | ScenarioCause::CapacityError { .. }
            | ScenarioCause::Settings { .. }
            | ScenarioCause::TooManyEmulated { .. }
            | ScenarioCause::ScriptRefused { .. }
            | ScenarioCause::ScriptTooLong { .. }
            | ScenarioCause::NotCompiled { .. }
            | ScenarioCause::Question { .. }
            | ScenarioCause::NotLoaded { .. }
            | ScenarioCause::Emulator { .. }
            | ScenarioCause::OneNumber { .. }
            | ScenarioCause::NoSuchMedium { .. } => None,
        }
    }
}

fn quantity_help(text: &str) -> String {
    if let Some(help) = super::aggregate::help(text) {
        return help;
    }
    let first = text.split(['.', '(']).next().expect("a split has at least one part");
    if first == "swarm" {
        let measures = super::value::FORMS.iter().filter(|form| form.starts_with("swarm."));
        return format!("one of {}", measures.copied().collect::<Vec<_>>().join(", "));
    }
    let forms = [super::value::FORMS, super::aggregate::FORMS].concat();
    one_of(first, &forms)
}
