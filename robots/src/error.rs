//! What can be wrong with a robot file, where, and what to do about it.

use crate::signature::{MAX_PARAMETERS, Type};
use std::fmt;
use std::ops::Range;

/// Why a robot could not be read. Its `Display` is a message for people: place, cause, source line and help.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RobotError {
    /// What is wrong.
    pub cause: Cause,
    /// Where; `None` if there is no file to point into.
    pub place: Option<Box<Place>>,
}

/// A place in a robot file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// Path of the file, as it was given.
    pub path: String,
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// How many characters of the line are meant; at least 1.
    pub width: usize,
    /// The text of the line.
    pub source: String,
}

/// What is wrong, one variant for each cause.
#[derive(Debug, Clone, PartialEq, Eq)]
#[allow(missing_docs, reason = "the fields are what the messages below print")]
pub enum Cause {
    /// `--robot` names no robot that ships.
    UnknownRobot { name: String },
    /// The file cannot be read.
    Unreadable { path: String, reason: String },
    /// The file is not TOML.
    Syntax { message: String },
    /// A key that means nothing.
    UnknownKey { key: String, section: &'static str, known: &'static [&'static str] },
    /// A key that must be there is not.
    MissingKey { key: &'static str, section: &'static str },
    /// A value of another type than the key takes.
    WrongType { key: String, expected: &'static str, found: &'static str },
    /// A size that is zero or absurd.
    OutOfRange { key: &'static str, value: String, min: u32, max: u32 },
    /// More slots than the machine has room for, beside everything else in it.
    TooManySlots { slots: u32, slot_bytes: u32, memory: u32, most: u32 },
    /// An address at which no region can begin.
    Unaligned { address: u32, to: u32 },
    /// Two regions of memory that share bytes.
    Overlap { key: &'static str, other: &'static str },
    /// Neither `tiny` nor `full`.
    UnknownProfile { name: String },
    /// A robot name that is no lower-case word.
    BadRobotName { name: String },
    /// A text that must be one line and is empty or has several.
    NotOneLine { key: &'static str },
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

impl RobotError {
    pub(crate) fn unknown_robot(name: &str) -> RobotError {
        RobotError { cause: Cause::UnknownRobot { name: name.to_owned() }, place: None }
    }

    pub(crate) fn unreadable(path: &str, error: &std::io::Error) -> RobotError {
        let cause = Cause::Unreadable { path: path.to_owned(), reason: error.to_string() };
        RobotError { cause, place: None }
    }
}

impl Place {
    /// The place of a range of bytes of a file. A range outside the text means its end.
    pub fn new(path: &str, text: &str, span: Range<usize>) -> Place {
        let before = text.get(..span.start).unwrap_or(text);
        let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
        let from_line = text.get(line_start..).unwrap_or_default();
        let source = from_line.lines().next().unwrap_or_default();
        let in_line = text.get(line_start..before.len()).unwrap_or_default();
        let column = in_line.chars().count();
        let meant = text.get(span).unwrap_or_default().lines().next().unwrap_or_default();
        Place {
            path: path.to_owned(),
            line: before.matches('\n').count() + 1,
            column: column + 1,
            width: meant.chars().count().max(1),
            source: source.to_owned(),
        }
    }
}

impl fmt::Display for RobotError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.place {
            None => write!(f, "{}", self.cause)?,
            Some(place) => {
                let Place { path, line, column, width, source } = place.as_ref();
                let gutter = line.to_string().len();
                writeln!(f, "{path}:{line}:{column}: {}", self.cause)?;
                writeln!(f, "{line} | {source}")?;
                write!(f, "{:gutter$} | {:indent$}{:^<width$}", "", "", "", indent = column - 1)?;
            }
        }
        match self.cause.help() {
            Some(help) => write!(f, "\nhelp: {help}"),
            None => Ok(()),
        }
    }
}

impl std::error::Error for RobotError {}

impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Cause::UnknownRobot { name } => write!(f, "no robot is named `{name}`"),
            Cause::Unreadable { path, reason } => write!(f, "cannot read `{path}`: {reason}"),
            Cause::Syntax { message } => write!(f, "this is not TOML: {message}"),
            Cause::UnknownKey { key, section, .. } => write!(f, "unknown key `{key}` in {section}"),
            Cause::MissingKey { key, section } => write!(f, "{section} has no `{key}`"),
            Cause::WrongType { key, expected, found } => {
                write!(f, "`{key}` must be {expected}, not {found}")
            }
            Cause::OutOfRange { key, value, .. } => write!(f, "`{key}` cannot be {value}"),
            Cause::TooManySlots { slots, slot_bytes, memory, .. } => write!(
                f,
                "{slots} slots of {slot_bytes} bytes do not fit in {memory} bytes of `memory`, beside neighbours and messages"
            ),
            Cause::Unaligned { address, to } => {
                write!(f, "a region cannot begin at {address:#010x}: no multiple of {to}")
            }
            Cause::Overlap { key, other } => write!(f, "`{key}` and `{other}` overlap"),
            Cause::UnknownProfile { name } => write!(f, "there is no profile `{name}`"),
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

impl Cause {
    /// What to do about it, if the message does not say so by itself.
    pub fn help(&self) -> Option<String> {
        match self {
            Cause::UnknownRobot { name } => {
                let known: Vec<&str> = crate::shipped().iter().map(|(name, _)| *name).collect();
                let hint = match likely(name, &known) {
                    Some(likely) => format!("did you mean `{likely}`?"),
                    None => format!("known robots: {}", known.join(", ")),
                };
                Some(format!("{hint} (a file of your own: a path that ends in .toml)"))
            }
            Cause::UnknownKey { key, known, .. } => Some(one_of(key, known)),
            Cause::OutOfRange { min, max, .. } => Some(format!("a number from {min} to {max}")),
            Cause::TooManySlots { most, .. } => {
                Some(format!("there is room for {most} `slots`; or give it more `memory`"))
            }
            Cause::Unaligned { .. } => Some(
                "the chip wants its vector table there; a sector of flash begins so".to_owned(),
            ),
            Cause::UnknownProfile { name } => Some(one_of(name, &["tiny", "full"])),
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
            | Cause::Syntax { .. }
            | Cause::MissingKey { .. }
            | Cause::WrongType { .. }
            | Cause::Overlap { .. }
            | Cause::NotOneLine { .. }
            | Cause::RepeatedList
            | Cause::RepeatedParameter { .. }
            | Cause::TooManyParameters => None,
        }
    }
}

/// Help for a name that is none of those that are known: the one that was probably meant, else all of them. Of `global.NAME`
/// and `distance(X, Y)` only the first word is compared.
pub fn one_of<T: AsRef<str>>(name: &str, known: &[T]) -> String {
    match likely(name, known) {
        Some(likely) => format!("did you mean `{likely}`?"),
        None => format!("one of {}", known.iter().map(T::as_ref).collect::<Vec<_>>().join(", ")),
    }
}

/// The known name that was probably meant.
fn likely<'a, T: AsRef<str>>(name: &str, known: &'a [T]) -> Option<&'a str> {
    let distance = |known: &&str| {
        let word = known.split(['.', '(']).next().unwrap_or_default();
        strsim::damerau_levenshtein(name, word)
    };
    let closest = known.iter().map(T::as_ref).min_by_key(distance);
    closest.filter(|known| distance(known) <= name.chars().count().max(3) / 3)
}
