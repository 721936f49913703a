//! Mistakes in a file, and their corrections.

use std::fmt;

/// The largest number of mistakes that are kept for a file.
pub const MISTAKES_MAX: usize = 100;

/// The largest number of names in a help text.
const LISTED: usize = 24;

/// A reason why a format refuses a file. `Display` writes one sentence.
pub trait Cause: fmt::Display + From<TomlError> {
    /// Returns the correction, if the sentence does not contain it.
    fn help(&self) -> Option<String>;
}

/// A mistake in a file. `Display` writes the sentence of the cause.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FileError<C> {
    pub cause: C,
    /// Place of the mistake; `None` if there is no text to point into.
    pub place: Option<Box<crate::Place>>,
}

/// The mistakes that any TOML file can have, one variant for each cause.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum TomlError {
    /// The file is not TOML.
    Syntax { message: String },
    /// The file is not TOML, because a bracket or brace has no partner.
    Unclosed { open: char, close: char },
    /// A key that the section does not have.
    UnknownKey { key: String, section: &'static str, known: Vec<&'static str> },
    /// A required key is missing.
    MissingKey { key: &'static str, section: &'static str },
    /// A value of another type than the key takes.
    WrongType { key: String, expected: &'static str, found: &'static str },
    /// A number out of its range.
    OutOfRange { key: String, value: String, range: String },
    /// A word that the key does not take.
    UnknownWord { key: String, word: String, known: Vec<String> },
    /// None of several keys, one of which is required.
    NoneOf { section: &'static str, keys: &'static [&'static str] },
    /// Two keys that exclude each other.
    Both { key: &'static str, other: &'static str },
    /// A list of the wrong length.
    Length { key: String, expected: &'static str, found: usize },
    /// An override for an entry of a list that does not exist.
    NoSuchEntry { path: String, count: usize },
    /// More mistakes than [`MISTAKES_MAX`].
    More { count: usize },
}

/// For files whose only mistakes are those that any TOML file can have.
impl Cause for TomlError {
    fn help(&self) -> Option<String> {
        TomlError::help(self)
    }
}

impl<C: Cause> FileError<C> {
    /// Returns the correction, if the message does not contain it.
    pub fn help(&self) -> Option<String> {
        self.cause.help()
    }
}

impl<C: Cause> fmt::Display for FileError<C> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.cause.fmt(f)
    }
}

impl<C: Cause + fmt::Debug> std::error::Error for FileError<C> {}

impl fmt::Display for TomlError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            TomlError::Syntax { message } => write!(f, "this is not TOML: {message}"),
            TomlError::Unclosed { open, .. } => {
                write!(f, "this is not TOML: this `{open}` is never closed")
            }
            TomlError::UnknownKey { key, section, .. } => {
                write!(f, "unknown key `{key}` in {section}")
            }
            TomlError::MissingKey { key, section } => write!(f, "{section} has no `{key}`"),
            TomlError::WrongType { key, expected, found } => {
                write!(f, "`{key}` must be {expected}, not {found}")
            }
            TomlError::OutOfRange { key, value, .. } => write!(f, "`{key}` cannot be {value}"),
            TomlError::UnknownWord { key, word, .. } => write!(f, "`{key}` cannot be \"{word}\""),
            TomlError::NoneOf { section, .. } => write!(f, "{section} does not say what is meant"),
            TomlError::Both { key, other } => {
                write!(f, "`{key}` and `{other}` cannot stand together")
            }
            TomlError::Length { key, expected, found } => {
                write!(f, "`{key}` must be {expected}, not a list of {found}")
            }
            TomlError::NoSuchEntry { path, count } => {
                write!(f, "there is no `{path}`: the file has {count}, and they count from 0")
            }
            TomlError::More { count: 1 } => write!(f, "1 more mistake is not shown"),
            TomlError::More { count } => write!(f, "{count} more mistakes are not shown"),
        }
    }
}

impl TomlError {
    /// Returns the correction, if the message does not contain it.
    pub fn help(&self) -> Option<String> {
        match self {
            TomlError::UnknownKey { key, known, .. } => Some(one_of(key, known)),
            TomlError::UnknownWord { word, known, .. } => Some(one_of(word, known)),
            TomlError::OutOfRange { range, .. } => Some(range.clone()),
            TomlError::Unclosed { close, .. } => Some(format!("write the `{close}` that ends it")),
            TomlError::NoneOf { keys, .. } => Some(format!("one of {} is needed", keys.join(", "))),
            TomlError::Syntax { .. }
            | TomlError::MissingKey { .. }
            | TomlError::WrongType { .. }
            | TomlError::Both { .. }
            | TomlError::Length { .. }
            | TomlError::NoSuchEntry { .. }
            | TomlError::More { .. } => None,
        }
    }
}

/// Returns help for an unknown name: the likely name if there is one, else the known names. Only
/// the first word of forms such as `global.NAME` and `distance(X, Y)` is compared.
pub fn one_of<T: AsRef<str>>(name: &str, known: &[T]) -> String {
    if let Some(likely) = nearest_name(name, known) {
        return format!("did you mean `{likely}`?");
    }
    let listed: Vec<&str> = known.iter().map(T::as_ref).take(LISTED).collect();
    match known.len() - listed.len() {
        0 => format!("one of {}", listed.join(", ")),
        more => format!("one of {} and {more} more", listed.join(", ")),
    }
}

/// Returns the known name that was probably meant.
pub(crate) fn nearest_name<'a, T: AsRef<str>>(name: &str, known: &'a [T]) -> Option<&'a str> {
    let length = name.chars().count();
    let most = length.max(3) / 3;
    let distance = |known: &str| {
        let word = known.find(['.', '(']).map_or(known, |end| &known[..end]);
        // The name may be a key without its unit, such as `radius` for `radius_mm`.
        if !name.is_empty() && word.strip_prefix(name).is_some_and(|rest| rest.starts_with('_')) {
            return Some(1);
        }
        // The difference in length is a lower bound of the distance, so distant words need no
        // comparison.
        let is_near = word.chars().count().abs_diff(length) <= most;
        is_near.then(|| strsim::damerau_levenshtein(name, word)).filter(|steps| *steps <= most)
    };
    let near = known.iter().filter_map(|known| Some((distance(known.as_ref())?, known.as_ref())));
    near.min_by_key(|(distance, _)| *distance).map(|(_, known)| known)
}
