//! Mistakes in a robot file: cause, place and correction.

use std::fmt;

use bittybuzz_toml_reader::{self as toml_reader, FileError, Place, TomlError, file, one_of};

use crate::signature::{MAX_PARAMETERS, Type};

/// A mistake in a robot file.
pub type RobotError = FileError<Cause>;

/// The reasons why a robot could not be read; at least one. `Display` writes a message for people:
/// place, cause, source line and help of each mistake.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RobotErrors(pub Vec<RobotError>);

/// A mistake, one variant for each cause.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Cause {
    /// `--robot` names no robot that ships; `known` are the robots that do.
    UnknownRobot { name: String, known: Vec<String> },
    /// The file cannot be read.
    Unreadable { path: String, reason: String },
    /// A mistake that any TOML file can have.
    Toml(TomlError),
    /// More slots than the machine has room for next to everything else in it.
    TooManySlots { slots: u32, slot_bytes: u32, memory: u32, most: u32, least: u32 },
    /// An address at which no region can begin.
    Unaligned { address: u32, to: u32 },
    /// A log of scripts that is not two sectors with whole places.
    BadLog { size: u32, unit: u32 },
    /// Two regions of memory that share bytes.
    Overlap { key: &'static str, other: &'static str },
    /// A robot name that is not a lower-case word.
    BadRobotName { name: String },
    /// A text that must be one line but is empty or has several lines.
    NotOneLine { key: String },
    /// A name that is not a valid identifier in scripts.
    BadIdentifier { name: String },
    /// A name that the language itself uses.
    Reserved { name: String },
    /// Two functions or tables of one name.
    DuplicateName { name: String, line: usize },
    /// Two names with the same hash, which images use as the number of a function.
    HashCollision { name: String, other: String },
    /// Two names that give the same constant in generated code.
    ConstantCollision { name: String, other: String, constant: String },
    /// No argument list at all.
    AcceptsNothing,
    /// Two argument lists with the same types.
    RepeatedList,
    /// A parameter that is not `name: type`.
    BadParameter { text: String },
    /// Two parameters or fields of one name.
    RepeatedParameter { name: String },
    /// A parameter after a repeated one, which takes all other arguments.
    AfterRepeated { parameter: String },
    /// A field that is marked as repeated.
    RepeatedField { field: String },
    /// More parameters than a function can have.
    TooManyParameters,
    /// A type that does not exist.
    UnknownType { name: String },
    /// A table without fields.
    NoFields,
    /// A key that belongs to another drive or another kind of sensor.
    KeyOfAnother { key: &'static str, word: &'static str, known: Vec<&'static str> },
    /// No beam or too many beams.
    NumberOfBeams { count: usize, most: u32 },
    /// A second sensor that is a link.
    SecondLink { line: usize },
    /// A key for the simulator in the file of a robot without a body.
    NoBody { key: &'static str },
    /// A function that does nothing in the simulator.
    NoEffect { name: String },
    /// A function that returns a value but reads no sensor.
    ReturnsNothingRead { name: String },
    /// A function that reads something and returns nothing.
    ReadsWithoutResult { name: String },
    /// A table `sets` without a quantity.
    SetsNothing,
    /// A list of arguments with which a call changes nothing.
    ListSetsNothing { list: String },
    /// A quantity that the drive does not have.
    NotOfDrive { key: &'static str, drive: &'static str, known: Vec<&'static str> },
    /// A value of a quantity that is neither a number nor a parameter.
    BadAmount { text: String },
    /// A parameter that the function does not have.
    UnknownParameter { name: String, known: Vec<String> },
    /// A parameter that may be something other than a number.
    NoNumber { parameter: String },
    /// A unit that the quantity does not have.
    UnknownUnit { unit: String, key: &'static str, known: Vec<&'static str> },
    /// A sensor that the file does not have.
    UnknownSensor { name: String, known: Vec<String> },
    /// A value that the sensor does not have, or no value for a sensor with several.
    UnknownSensorValue { sensor: String, value: Option<String>, known: Vec<String> },
    /// A function that reads one of several beams without a choice of the beam.
    WhichBeam { sensor: String, count: usize, most: usize },
}

impl RobotErrors {
    /// Returns the error for a name that is none of the `known` robots.
    pub fn unknown_robot<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> RobotErrors {
        let known = known.into_iter().map(str::to_owned).collect();
        let cause = Cause::UnknownRobot { name: name.to_owned(), known };
        RobotErrors(vec![RobotError { cause, place: None }])
    }

    /// Returns the mistake of a file that cannot be read.
    pub fn unreadable(path: &str, error: &file::ReadError) -> RobotErrors {
        let cause = Cause::Unreadable { path: path.to_owned(), reason: error.to_string() };
        RobotErrors(vec![RobotError { cause, place: None }])
    }
}

impl fmt::Display for RobotErrors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (number, error) in self.0.iter().enumerate() {
            if number > 0 {
                f.write_str("\n\n")?;
            }
            show(error, f)?;
        }
        Ok(())
    }
}

impl std::error::Error for RobotErrors {}

fn show(error: &RobotError, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    match &error.place {
        None => write!(f, "{error}")?,
        Some(place) => {
            let Place { path, line, column, width, source, source_column } = place.as_ref();
            let gutter = line.to_string().len();
            let indent = column - source_column;
            writeln!(f, "{path}:{line}:{column}: {error}")?;
            writeln!(f, "{line} | {source}")?;
            write!(f, "{:gutter$} | {:indent$}{:^<width$}", "", "", "")?;
        }
    }
    match error.help() {
        Some(help) => write!(f, "\nhelp: {help}"),
        None => Ok(()),
    }
}

impl From<TomlError> for Cause {
    fn from(error: TomlError) -> Self {
        Cause::Toml(error)
    }
}

impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Cause::UnknownRobot { name, .. } => write!(f, "no robot is named `{name}`"),
            Cause::Unreadable { path, reason } => write!(f, "cannot read `{path}`: {reason}"),
            Cause::Toml(error) => error.fmt(f),
            Cause::TooManySlots { slots, slot_bytes, memory, .. } => write!(
                f,
                "{slots} slots of {slot_bytes} bytes do not fit in {memory} bytes of `memory`, with neighbors and messages"
            ),
            Cause::Unaligned { address, to } => {
                write!(f, "a region cannot begin at {address:#010x}: no multiple of {to}")
            }
            Cause::BadLog { size, unit } => {
                write!(f, "a log of scripts cannot have {size} bytes: no multiple of {unit}")
            }
            Cause::Overlap { key, other } => write!(f, "`{key}` and `{other}` overlap"),
            Cause::BadRobotName { name } => write!(f, "`{name}` cannot be the name of a robot"),
            Cause::NotOneLine { key } => write!(f, "`{key}` must be one line of text"),
            Cause::BadIdentifier { name } => write!(f, "`{name}` cannot be a name in a script"),
            Cause::Reserved { name } => write!(f, "`{name}` is a name of the Buzz language"),
            Cause::DuplicateName { name, .. } => write!(f, "`{name}` is defined a second time"),
            Cause::HashCollision { name, other } => {
                write!(f, "`{name}` and `{other}` have the same name hash")
            }
            Cause::ConstantCollision { name, other, constant } => {
                write!(f, "`{name}` and `{other}` would both be the constant `{constant}`")
            }
            Cause::AcceptsNothing => write!(f, "the function accepts no argument list"),
            Cause::RepeatedList => write!(f, "the same types of arguments are listed twice"),
            Cause::BadParameter { text } => write!(f, "`{text}` is not a parameter"),
            Cause::RepeatedParameter { name } => write!(f, "`{name}` stands twice in the list"),
            Cause::AfterRepeated { parameter } => {
                write!(f, "no parameter can follow `{parameter}`, which takes all other arguments")
            }
            Cause::RepeatedField { field } => {
                write!(
                    f,
                    "`{field}` is no field: only the last parameter of a function takes `...`"
                )
            }
            Cause::TooManyParameters => {
                write!(f, "a list cannot have more than {MAX_PARAMETERS} entries")
            }
            Cause::UnknownType { name } => write!(f, "there is no type `{name}`"),
            Cause::NoFields => write!(f, "the table has no fields"),
            Cause::KeyOfAnother { key, word, .. } => write!(f, "\"{word}\" has no `{key}`"),
            Cause::NumberOfBeams { count, .. } => write!(f, "a sensor cannot have {count} beams"),
            Cause::SecondLink { .. } => write!(f, "a robot has one link"),
            Cause::NoBody { key } => write!(f, "`{key}` has no meaning without a [body]"),
            Cause::NoEffect { name } => write!(f, "`{name}` has no effect in the simulator"),
            Cause::ReturnsNothingRead { name } => {
                write!(f, "`{name}` returns a value, but reads no sensor")
            }
            Cause::ReadsWithoutResult { name } => {
                write!(f, "`{name}` reads a sensor, but returns no number")
            }
            Cause::SetsNothing => write!(f, "`sets` names no quantity"),
            Cause::ListSetsNothing { list } => {
                write!(f, "a call with the arguments ({list}) sets nothing")
            }
            Cause::NotOfDrive { key, drive, .. } => {
                write!(f, "a body with the drive \"{drive}\" has no `{key}`")
            }
            Cause::BadAmount { text } => {
                write!(f, "`{text}` is neither a number nor the name of a parameter")
            }
            Cause::UnknownParameter { name, .. } => {
                write!(f, "the function has no parameter `{name}`")
            }
            Cause::NoNumber { parameter } => {
                write!(f, "the parameter `{parameter}` is not always one number")
            }
            Cause::UnknownUnit { unit, key, .. } => write!(f, "`{key}` has no unit `{unit}`"),
            Cause::UnknownSensor { name, .. } => write!(f, "there is no sensor `{name}`"),
            Cause::UnknownSensorValue { sensor, value: Some(value), .. } => {
                write!(f, "the sensor `{sensor}` has no value `{value}`")
            }
            Cause::UnknownSensorValue { sensor, value: None, .. } => {
                write!(f, "the sensor `{sensor}` has several values")
            }
            Cause::WhichBeam { sensor, count, .. } => {
                write!(
                    f,
                    "the sensor `{sensor}` has {count} beams, and the call does not choose one"
                )
            }
        }
    }
}

impl toml_reader::Cause for Cause {
    fn help(&self) -> Option<String> {
        match self {
            Cause::UnknownRobot { name, known } => {
                let hint = one_of(name, known);
                Some(format!("{hint} (a file of your own: a path that ends in .toml)"))
            }
            Cause::Toml(error) => error.help(),
            Cause::TooManySlots { most, least, .. } => Some(format!(
                "there is room for {most} `slots`; or set `memory` to {least} or more: earlier versions needed less"
            )),
            Cause::Unaligned { .. } => Some(
                "the chip wants its vector table there; a sector of flash begins so".to_owned(),
            ),
            Cause::BadLog { .. } => {
                Some("`script` is two sectors of flash of equal size with `script_log`".to_owned())
            }
            Cause::BadRobotName { .. } => {
                Some("lower-case letters, digits and `-`, a letter first".to_owned())
            }
            Cause::BadIdentifier { .. } => {
                Some("letters, digits and `_`, no digit first".to_owned())
            }
            Cause::DuplicateName { line, .. } => Some(format!("first defined in line {line}")),
            Cause::Reserved { .. }
            | Cause::HashCollision { .. }
            | Cause::ConstantCollision { .. } => Some("choose another name".to_owned()),
            Cause::AcceptsNothing => {
                Some("write `accepts = [\"\"]` if it takes no arguments".to_owned())
            }
            Cause::BadParameter { .. } => {
                Some("write `name: type`, separated by commas, as in \"x: int, y: int\"".to_owned())
            }
            Cause::AfterRepeated { .. } => Some("write it last".to_owned()),
            Cause::RepeatedField { .. } => Some("remove the `...`".to_owned()),
            Cause::UnknownType { name } => Some(one_of(name, &Type::ALL.map(Type::name))),
            Cause::NoFields => Some("write them as in \"x: number, y: number\"".to_owned()),
            Cause::KeyOfAnother { known, .. } => Some(format!("it has {}", known.join(", "))),
            Cause::NumberOfBeams { most, .. } => Some(format!("from 1 to {most} beams")),
            Cause::SecondLink { line } => Some(format!("the other one is in line {line}")),
            Cause::NoBody { .. } => Some(
                "add a [body] with `drive`, `radius_mm` and `speed_mm_s`, or remove the key"
                    .to_owned(),
            ),
            Cause::NoEffect { .. } => Some(
                "add `sets = { QUANTITY = \"PARAMETER\" }`, `reads = \"SENSOR\"`, or `logs = true`"
                    .to_owned(),
            ),
            Cause::ReturnsNothingRead { .. } => Some(
                "add `reads = \"SENSOR\"`, or remove `returns`; with `logs = true` it returns 0"
                    .to_owned(),
            ),
            Cause::ReadsWithoutResult { .. } => Some("add `returns = \"int\"`".to_owned()),
            Cause::SetsNothing => Some(
                "write a quantity and its value, as in `sets = { forward = \"speed\" }`".to_owned(),
            ),
            Cause::ListSetsNothing { .. } => Some(
                "remove the list from `accepts`, or set a quantity from its parameters".to_owned(),
            ),
            Cause::NotOfDrive { known, .. } => Some(format!("one of {}", known.join(", "))),
            Cause::BadAmount { .. } => {
                Some("write 80, \"speed\", \"-rate rad/s\", \"50 %\" or \"duty of 255\"".to_owned())
            }
            Cause::UnknownParameter { known, .. } if known.is_empty() => {
                Some("it takes no argument: write a number".to_owned())
            }
            Cause::UnknownParameter { name, known } => Some(one_of(name, known)),
            Cause::NoNumber { .. } => {
                Some("its type must be int or number, without `...`".to_owned())
            }
            Cause::UnknownUnit { known, .. } if known.is_empty() => {
                Some("write the value alone".to_owned())
            }
            Cause::UnknownUnit { unit, known, .. } => Some(one_of(unit, known)),
            Cause::UnknownSensor { known, .. } if known.is_empty() => {
                Some("the file has no [[sensor]]".to_owned())
            }
            Cause::UnknownSensor { name, known } => Some(one_of(name, known)),
            Cause::UnknownSensorValue { sensor, known, .. } if known.is_empty() => {
                Some(format!("it has one value: write \"{sensor}\""))
            }
            Cause::UnknownSensorValue { sensor, known, .. } => {
                let known: Vec<String> =
                    known.iter().map(|value| format!("\"{sensor}.{value}\"")).collect();
                Some(format!("one of {}", known.join(", ")))
            }
            Cause::WhichBeam { sensor, most, .. } => Some(format!(
                "write `accepts = [\"beam: int\"]`, or name a beam from \"{sensor}.0\" to \"{sensor}.{most}\""
            )),
            Cause::Unreadable { .. }
            | Cause::Overlap { .. }
            | Cause::NotOneLine { .. }
            | Cause::RepeatedList
            | Cause::RepeatedParameter { .. }
            | Cause::TooManyParameters => None,
        }
    }
}
