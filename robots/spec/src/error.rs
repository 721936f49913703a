//! What can be wrong with a robot file, where, and what to do about it.

use std::fmt;

use bittybuzz_toml_reader::{self as toml_reader, FileError, Place, TomlError, file, one_of};

use crate::signature::{MAX_PARAMETERS, Type};

/// A mistake in a robot file.
pub type RobotError = FileError<Cause>;

/// The reasons why a robot could not be read; at least one. Its `Display` is a message for people: place, cause, source
/// line and help of each.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RobotErrors(pub Vec<RobotError>);

/// What is wrong, one variant for each cause.
#[derive(Debug, Clone, PartialEq, Eq)]
#[allow(missing_docs, reason = "the fields are what the messages below print")]
pub enum Cause {
    /// `--robot` names no robot that ships; `known` are those that do.
    UnknownRobot { name: String, known: Vec<String> },
    /// The file cannot be read.
    Unreadable { path: String, reason: String },
    /// A mistake that any TOML file can have.
    Toml(TomlError),
    /// More slots than the machine has room for, beside everything else in it.
    TooManySlots { slots: u32, slot_bytes: u32, memory: u32, most: u32, least: u32 },
    /// An address at which no region can begin.
    Unaligned { address: u32, to: u32 },
    /// A log of scripts that is not two sectors with whole places.
    BadLog { size: u32, unit: u32 },
    /// Two regions of memory that share bytes.
    Overlap { key: &'static str, other: &'static str },
    /// A robot name that is no lower-case word.
    BadRobotName { name: String },
    /// A text that must be one line and is empty or has several.
    NotOneLine { key: String },
    /// A name that no script could use.
    BadIdentifier { name: String },
    /// A name that the language itself uses.
    Reserved { name: String },
    /// Two functions or tables of one name.
    DuplicateName { name: String, line: usize },
    /// Two names that are known to images by the same number.
    HashCollision { name: String, other: String },
    /// Two names that give the same constant in generated code.
    ConstantCollision { name: String, other: String, constant: String },
    /// No list of arguments at all.
    AcceptsNothing,
    /// The same list of argument types twice.
    RepeatedList,
    /// A parameter that is not `name: type`.
    BadParameter { text: String },
    /// Two parameters or fields of one name.
    RepeatedParameter { name: String },
    /// More arguments than a call can pass.
    TooManyParameters,
    /// A type that does not exist.
    UnknownType { name: String },
    /// A table without fields.
    NoFields,
}

impl RobotErrors {
    /// The error for a name that is none of the `known` robots.
    pub fn unknown_robot<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> RobotErrors {
        let known = known.into_iter().map(str::to_owned).collect();
        let cause = Cause::UnknownRobot { name: name.to_owned(), known };
        RobotErrors(vec![RobotError { cause, place: None }])
    }

    pub(crate) fn unreadable(path: &str, error: &file::ReadError) -> RobotErrors {
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
                "{slots} slots of {slot_bytes} bytes do not fit in {memory} bytes of `memory`, beside neighbours and messages"
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
            Cause::TooManyParameters => {
                write!(f, "a list cannot have more than {MAX_PARAMETERS} entries")
            }
            Cause::UnknownType { name } => write!(f, "there is no type `{name}`"),
            Cause::NoFields => write!(f, "the table has no fields"),
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
            Cause::UnknownType { name } => Some(one_of(name, &Type::ALL.map(Type::name))),
            Cause::NoFields => Some("write them as in \"x: number, y: number\"".to_owned()),
            Cause::Unreadable { .. }
            | Cause::Overlap { .. }
            | Cause::NotOneLine { .. }
            | Cause::RepeatedList
            | Cause::RepeatedParameter { .. }
            | Cause::TooManyParameters => None,
        }
    }
}
