//! Mistakes in a robot file: cause, place and correction.

use std::fmt;

use bittybuzz_toml_reader::{self as toml_reader, FileError, Place, TomlError, file, one_of};

use crate::signature::{PARAMETERS_MAX, SignatureType};

/// A mistake in a robot file.
pub type RobotError = FileError<RobotFileCause>;

/// The reasons why a robot could not be read; at least one. `Display` writes a message for people:
/// place, cause, source line and help of each mistake.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RobotErrors(pub Vec<RobotError>);

/// A mistake, one variant for each cause.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RobotFileCause {
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
    /// A range of a parameter that is none, or whose parameter is no number.
    BadRange { text: String },
    /// A field with a range.
    RangeOfField { field: String },
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
    /// A function that steers a body without a rule for it.
    NoSteering,
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
    /// A name of a value that leads into no table.
    BadPath { text: String },
    /// A name that is that of a table with other names in it.
    NameIsTable { name: String, line: usize },
    /// A value that is neither a number nor a reading.
    NoValue { name: String },
    /// Several numbers or readings for a value that is no list.
    NotAList { name: String },
    /// A list whose number of elements is not known.
    NoCount { name: String },
    /// A second number of elements for a list. `line` has the first, unless `count` of the same value
    /// differs.
    OtherCount { name: String, count: u32, other: u32, line: Option<usize> },
    /// No element or too many elements.
    NumberOfElements { count: usize, most: u32 },
    /// Readings of one value in different units.
    UnlikeUnits,
    /// A curve for a reading in a unit.
    CurveWithUnit,
    /// A curve that is not at least two pairs by rising readings.
    BadCurve,
    /// A function that reads one of several beams without a choice of the beam.
    WhichBeam { sensor: String, count: usize, most: usize },
}

impl RobotErrors {
    /// Returns the error for a name that is none of the `known` robots.
    pub fn unknown_robot<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> RobotErrors {
        let known = known.into_iter().map(str::to_owned).collect();
        let cause = RobotFileCause::UnknownRobot { name: name.to_owned(), known };
        RobotErrors(vec![RobotError { cause, place: None }])
    }

    /// Returns the mistake of a file that cannot be read.
    pub fn unreadable(path: &str, error: &file::ReadError) -> RobotErrors {
        let cause = RobotFileCause::Unreadable { path: path.to_owned(), reason: error.to_string() };
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

impl From<TomlError> for RobotFileCause {
    fn from(error: TomlError) -> Self {
        RobotFileCause::Toml(error)
    }
}

impl fmt::Display for RobotFileCause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            RobotFileCause::UnknownRobot { name, .. } => write!(f, "no robot is named `{name}`"),
            RobotFileCause::Unreadable { path, reason } => {
                write!(f, "cannot read `{path}`: {reason}")
            }
            RobotFileCause::Toml(error) => error.fmt(f),
            RobotFileCause::TooManySlots { slots, slot_bytes, memory, .. } => write!(
                f,
                "{slots} slots of {slot_bytes} bytes do not fit in {memory} bytes of `memory`, with neighbors and messages"
            ),
            RobotFileCause::Unaligned { address, to } => {
                write!(f, "a region cannot begin at {address:#010x}: no multiple of {to}")
            }
            RobotFileCause::BadLog { size, unit } => {
                write!(f, "a log of scripts cannot have {size} bytes: no multiple of {unit}")
            }
            RobotFileCause::Overlap { key, other } => write!(f, "`{key}` and `{other}` overlap"),
            RobotFileCause::BadRobotName { name } => {
                write!(f, "`{name}` cannot be the name of a robot")
            }
            RobotFileCause::NotOneLine { key } => write!(f, "`{key}` must be one line of text"),
            RobotFileCause::BadIdentifier { name } => {
                write!(f, "`{name}` cannot be a name in a script")
            }
            RobotFileCause::Reserved { name } => {
                write!(f, "`{name}` is a name of the Buzz language")
            }
            RobotFileCause::DuplicateName { name, .. } => {
                write!(f, "`{name}` is defined a second time")
            }
            RobotFileCause::HashCollision { name, other } => {
                write!(f, "`{name}` and `{other}` have the same name hash")
            }
            RobotFileCause::ConstantCollision { name, other, constant } => {
                write!(f, "`{name}` and `{other}` would both be the constant `{constant}`")
            }
            RobotFileCause::AcceptsNothing => write!(f, "the function accepts no argument list"),
            RobotFileCause::RepeatedList => {
                write!(f, "the same types of arguments are listed twice")
            }
            RobotFileCause::BadParameter { text } => write!(f, "`{text}` is not a parameter"),
            RobotFileCause::BadRange { text } => write!(f, "`{text}` is no range"),
            RobotFileCause::RangeOfField { field } => {
                write!(f, "`{field}` is no field: only a parameter of a function has a range")
            }
            RobotFileCause::RepeatedParameter { name } => {
                write!(f, "`{name}` stands twice in the list")
            }
            RobotFileCause::AfterRepeated { parameter } => {
                write!(f, "no parameter can follow `{parameter}`, which takes all other arguments")
            }
            RobotFileCause::RepeatedField { field } => {
                write!(
                    f,
                    "`{field}` is no field: only the last parameter of a function takes `...`"
                )
            }
            RobotFileCause::TooManyParameters => {
                write!(f, "a list cannot have more than {PARAMETERS_MAX} entries")
            }
            RobotFileCause::UnknownType { name } => write!(f, "there is no type `{name}`"),
            RobotFileCause::NoFields => write!(f, "the table has no fields"),
            RobotFileCause::KeyOfAnother { key, word, .. } => {
                write!(f, "\"{word}\" has no `{key}`")
            }
            RobotFileCause::NumberOfBeams { count, .. } => {
                write!(f, "a sensor cannot have {count} beams")
            }
            RobotFileCause::SecondLink { .. } => write!(f, "a robot has one link"),
            RobotFileCause::NoBody { key } => write!(f, "`{key}` has no meaning without a [body]"),
            RobotFileCause::NoEffect { name } => {
                write!(f, "`{name}` has no effect in the simulator")
            }
            RobotFileCause::ReturnsNothingRead { name } => {
                write!(f, "`{name}` returns a value, but reads no sensor")
            }
            RobotFileCause::ReadsWithoutResult { name } => {
                write!(f, "`{name}` reads a sensor, but returns no number")
            }
            RobotFileCause::NoSteering => {
                write!(f, "`steers` has no meaning without a [body.steering]")
            }
            RobotFileCause::SetsNothing => write!(f, "`sets` names no quantity"),
            RobotFileCause::ListSetsNothing { list } => {
                write!(f, "a call with the arguments ({list}) sets nothing")
            }
            RobotFileCause::NotOfDrive { key, drive, .. } => {
                write!(f, "a body with the drive \"{drive}\" has no `{key}`")
            }
            RobotFileCause::BadAmount { text } => {
                write!(f, "`{text}` is neither a number nor the name of a parameter")
            }
            RobotFileCause::UnknownParameter { name, .. } => {
                write!(f, "the function has no parameter `{name}`")
            }
            RobotFileCause::NoNumber { parameter } => {
                write!(f, "the parameter `{parameter}` is not always one number")
            }
            RobotFileCause::UnknownUnit { unit, key, .. } => {
                write!(f, "`{key}` has no unit `{unit}`")
            }
            RobotFileCause::UnknownSensor { name, .. } => write!(f, "there is no sensor `{name}`"),
            RobotFileCause::UnknownSensorValue { sensor, value: Some(value), .. } => {
                write!(f, "the sensor `{sensor}` has no value `{value}`")
            }
            RobotFileCause::UnknownSensorValue { sensor, value: None, .. } => {
                write!(f, "the sensor `{sensor}` has several values")
            }
            RobotFileCause::BadPath { text } => {
                write!(f, "`{text}` is not the place of a value in a table")
            }
            RobotFileCause::NameIsTable { name, .. } => {
                write!(f, "`{name}` is a table of this robot, and nothing else")
            }
            RobotFileCause::NoValue { name } => write!(f, "`{name}` has no value"),
            RobotFileCause::NotAList { name } => {
                write!(f, "`{name}` is one value, not one for each element of a list")
            }
            RobotFileCause::NoCount { name } => {
                write!(f, "the number of elements of `{name}` is not known")
            }
            RobotFileCause::OtherCount { name, count, other, .. } => {
                write!(f, "`{name}` has {count} elements here and {other} elsewhere")
            }
            RobotFileCause::NumberOfElements { count, .. } => {
                write!(f, "a list cannot have {count} elements")
            }
            RobotFileCause::UnlikeUnits => {
                write!(f, "all readings of a value have the same unit")
            }
            RobotFileCause::CurveWithUnit => {
                write!(f, "a reading with a `curve` has no other unit")
            }
            RobotFileCause::BadCurve => {
                write!(f, "`curve` must be at least two pairs, by rising readings")
            }
            RobotFileCause::WhichBeam { sensor, count, .. } => {
                write!(
                    f,
                    "the sensor `{sensor}` has {count} beams, and the call does not choose one"
                )
            }
        }
    }
}

impl toml_reader::Cause for RobotFileCause {
    fn help(&self) -> Option<String> {
        match self {
            RobotFileCause::UnknownRobot { name, known } => {
                let hint = one_of(name, known);
                Some(format!("{hint} (a file of your own: a path that ends in .toml)"))
            }
            RobotFileCause::Toml(error) => error.help(),
            RobotFileCause::TooManySlots { most, least, .. } => Some(format!(
                "there is room for {most} `slots`; or set `memory` to {least} or more: earlier versions needed less"
            )),
            RobotFileCause::Unaligned { .. } => Some(
                "the chip wants its vector table there; a sector of flash begins so".to_owned(),
            ),
            RobotFileCause::BadLog { .. } => {
                Some("`script` is two sectors of flash of equal size with `script_log`".to_owned())
            }
            RobotFileCause::BadRobotName { .. } => {
                Some("lower-case letters, digits and `-`, a letter first".to_owned())
            }
            RobotFileCause::BadIdentifier { .. } => {
                Some("letters, digits and `_`, no digit first".to_owned())
            }
            RobotFileCause::DuplicateName { line, .. } => {
                Some(format!("first defined in line {line}"))
            }
            RobotFileCause::Reserved { .. }
            | RobotFileCause::HashCollision { .. }
            | RobotFileCause::ConstantCollision { .. } => Some("choose another name".to_owned()),
            RobotFileCause::AcceptsNothing => {
                Some("write `accepts = [\"\"]` if it takes no arguments".to_owned())
            }
            RobotFileCause::BadParameter { .. } => {
                Some("write `name: type`, separated by commas, as in \"x: int, y: int\"".to_owned())
            }
            RobotFileCause::BadRange { .. } => Some(
                "write the least and the greatest value of an int or a number, as in `duty: int 0..255`"
                    .to_owned(),
            ),
            RobotFileCause::RangeOfField { .. } => Some("remove the range".to_owned()),
            RobotFileCause::AfterRepeated { .. } => Some("write it last".to_owned()),
            RobotFileCause::RepeatedField { .. } => Some("remove the `...`".to_owned()),
            RobotFileCause::UnknownType { name } => {
                Some(one_of(name, &SignatureType::ALL.map(SignatureType::name)))
            }
            RobotFileCause::NoFields => {
                Some("write them as in \"x: number, y: number\"".to_owned())
            }
            RobotFileCause::KeyOfAnother { known, .. } => {
                Some(format!("it has {}", known.join(", ")))
            }
            RobotFileCause::NumberOfBeams { most, .. } => Some(format!("from 1 to {most} beams")),
            RobotFileCause::SecondLink { line } => Some(format!("the other one is in line {line}")),
            RobotFileCause::NoBody { .. } => Some(
                "add a [body] with `drive`, `radius_mm` and `speed_mm_s`, or remove the key"
                    .to_owned(),
            ),
            RobotFileCause::NoEffect { .. } => Some(
                "add `sets = { QUANTITY = \"PARAMETER\" }`, `steers`, `reads = \"SENSOR\"`, or `logs = true`"
                    .to_owned(),
            ),
            RobotFileCause::ReturnsNothingRead { .. } => Some(
                "add `reads = \"SENSOR\"`, or remove `returns`; with `logs = true` it returns 0"
                    .to_owned(),
            ),
            RobotFileCause::ReadsWithoutResult { .. } => Some("add `returns = \"int\"`".to_owned()),
            RobotFileCause::NoSteering => Some(
                "a body with two wheels takes one, with `hard_turn_deg`, `soft_turn_deg`, `no_turn_deg` and `speed_mm_s`"
                    .to_owned(),
            ),
            RobotFileCause::SetsNothing => Some(
                "write a quantity and its value, as in `sets = { forward = \"speed\" }`".to_owned(),
            ),
            RobotFileCause::ListSetsNothing { .. } => Some(
                "remove the list from `accepts`, or set a quantity from its parameters".to_owned(),
            ),
            RobotFileCause::NotOfDrive { known, .. } => {
                Some(format!("one of {}", known.join(", ")))
            }
            RobotFileCause::BadAmount { .. } => {
                Some("write 80, \"speed\", \"-rate rad/s\", \"50 %\" or \"duty of 255\"".to_owned())
            }
            RobotFileCause::UnknownParameter { known, .. } if known.is_empty() => {
                Some("it takes no argument: write a number".to_owned())
            }
            RobotFileCause::UnknownParameter { name, known } => Some(one_of(name, known)),
            RobotFileCause::NoNumber { .. } => {
                Some("its type must be int or number, without `...`".to_owned())
            }
            RobotFileCause::UnknownUnit { known, .. } if known.is_empty() => {
                Some("write the value alone".to_owned())
            }
            RobotFileCause::UnknownUnit { unit, known, .. } => Some(one_of(unit, known)),
            RobotFileCause::UnknownSensor { known, .. } if known.is_empty() => {
                Some("the file has no [[sensor]]".to_owned())
            }
            RobotFileCause::UnknownSensor { name, known } => Some(one_of(name, known)),
            RobotFileCause::UnknownSensorValue { sensor, known, .. } if known.is_empty() => {
                Some(format!("it has one value: write \"{sensor}\""))
            }
            RobotFileCause::UnknownSensorValue { sensor, known, .. } => {
                let known: Vec<String> =
                    known.iter().map(|value| format!("\"{sensor}.{value}\"")).collect();
                Some(format!("one of {}", known.join(", ")))
            }
            RobotFileCause::BadPath { .. } => Some(
                "write names and dots, as in \"pose.position.x\"; `[]` stands for the elements of a list, \
                 as in \"proximity[].value\""
                    .to_owned(),
            ),
            RobotFileCause::NameIsTable { line, .. } => {
                Some(format!("the other one is in line {line}: choose another name for one of them"))
            }
            RobotFileCause::NoValue { .. } => {
                Some("add `is = 0.0`, or `reads = \"SENSOR\"`".to_owned())
            }
            RobotFileCause::NotAList { .. } => Some(
                "a list has `[]` in its name, as in \"proximity[].value\"; else write one value"
                    .to_owned(),
            ),
            RobotFileCause::NoCount { .. } => {
                Some("add `count = 8`, or give one value for each element".to_owned())
            }
            RobotFileCause::OtherCount { line, .. } => Some(match line {
                Some(line) => format!("the list begins in line {line}"),
                None => "leave out `count`".to_owned(),
            }),
            RobotFileCause::NumberOfElements { most, .. } => {
                Some(format!("from 1 to {most} elements"))
            }
            RobotFileCause::UnlikeUnits => Some("write the same unit in all of them".to_owned()),
            RobotFileCause::CurveWithUnit => {
                Some("give the curve's readings in the unit of the sensor".to_owned())
            }
            RobotFileCause::BadCurve => {
                Some("as in `curve = [[0, 1.0], [100, 0.0]]`".to_owned())
            }
            RobotFileCause::WhichBeam { sensor, most, .. } => Some(format!(
                "write `accepts = [\"beam: int\"]`, or name a beam from \"{sensor}.0\" to \"{sensor}.{most}\""
            )),
            RobotFileCause::Unreadable { .. }
            | RobotFileCause::Overlap { .. }
            | RobotFileCause::NotOneLine { .. }
            | RobotFileCause::RepeatedList
            | RobotFileCause::RepeatedParameter { .. }
            | RobotFileCause::TooManyParameters => None,
        }
    }
}
