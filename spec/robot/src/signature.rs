//! The compact notation for parameters and fields: `"x: number, y: number"`, `"duty: int 0..255"` with
//! the least and the greatest value, and `"values: any..."` for a variable number of arguments.

use crate::error::RobotFileCause;
use std::fmt;
use std::ops::{Range, RangeInclusive};

/// The largest number of parameters of a robot function.
pub const PARAMETERS_MAX: usize = 7;

/// The type of a parameter, a result or a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SignatureType {
    /// An integer.
    Int,
    /// An int or a float for a parameter, a float for a result or a field.
    Number,
    /// A string.
    String,
    /// A table.
    Table,
    /// A function.
    Function,
    /// Any value, including nil.
    Any,
}

impl SignatureType {
    /// Every type.
    pub const ALL: [SignatureType; 6] = [
        SignatureType::Int,
        SignatureType::Number,
        SignatureType::String,
        SignatureType::Table,
        SignatureType::Function,
        SignatureType::Any,
    ];

    /// Returns the name in robot files.
    pub const fn name(self) -> &'static str {
        match self {
            SignatureType::Int => "int",
            SignatureType::Number => "number",
            SignatureType::String => "string",
            SignatureType::Table => "table",
            SignatureType::Function => "function",
            SignatureType::Any => "any",
        }
    }

    pub(crate) fn from_name(name: &str) -> Result<SignatureType, RobotFileCause> {
        SignatureType::ALL
            .into_iter()
            .find(|kind| kind.name() == name)
            .ok_or_else(|| RobotFileCause::UnknownType { name: name.to_owned() })
    }
}

impl fmt::Display for SignatureType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A parameter of a function, or a field of a table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Parameter {
    /// The name, for messages and documentation.
    pub name: String,
    /// The type that it accepts or holds.
    pub kind: SignatureType,
    /// The values that have a meaning, of a parameter that is a number: `duty: int 0..255`. The robot
    /// decides what becomes of others.
    pub range: Option<RangeInclusive<i32>>,
    /// True for a last parameter that stands for any number of arguments, including none:
    /// `values: any...`.
    pub is_repeated: bool,
}

impl fmt::Display for Parameter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.name, self.kind)?;
        if let Some(range) = &self.range {
            write!(f, " {}{TO}{}", range.start(), range.end())?;
        }
        if self.is_repeated { f.write_str(REPEATED) } else { Ok(()) }
    }
}

/// The mark after the type of a repeated parameter.
const REPEATED: &str = "...";

/// The mark between the least and the greatest value of a parameter.
const TO: &str = "..";

/// Returns true if a call with that many arguments passes all parameters of the list and no other
/// arguments.
pub fn takes_count(list: &[Parameter], count: usize) -> bool {
    match list.split_last() {
        Some((last, others)) if last.is_repeated => others.len() <= count,
        _ => list.len() == count,
    }
}

/// Returns the parameter for an argument, which counts from 0.
pub fn parameter_at(list: &[Parameter], argument: usize) -> Option<&Parameter> {
    list.get(argument).or_else(|| list.last().filter(|last| last.is_repeated))
}

/// A mistake in a list, and its byte range in the text.
pub type ListError = (Range<usize>, RobotFileCause);

/// Reads a list of parameters. An empty or blank text is the empty list.
pub fn parse_list(text: &str) -> Result<Vec<Parameter>, ListError> {
    let mut list: Vec<Parameter> = Vec::new();
    if text.trim().is_empty() {
        return Ok(list);
    }
    // Every part is a slice of `text`, so its address gives its place.
    let span_of = |part: &str| {
        let start = part.as_ptr().addr() - text.as_ptr().addr();
        start..start + part.len()
    };
    for item in text.split(',').map(str::trim) {
        let fail = |cause| Err((span_of(item), cause));
        let Some((name, kind)) = item.split_once(':') else {
            return fail(RobotFileCause::BadParameter { text: item.to_owned() });
        };
        let (name, kind) = (name.trim(), kind.trim());
        if !is_identifier(name) {
            return fail(RobotFileCause::BadParameter { text: item.to_owned() });
        }
        if list.iter().any(|other| other.name == name) {
            return fail(RobotFileCause::RepeatedParameter { name: name.to_owned() });
        }
        if list.len() == PARAMETERS_MAX {
            return fail(RobotFileCause::TooManyParameters);
        }
        if let Some(previous) = list.last().filter(|previous| previous.is_repeated) {
            return fail(RobotFileCause::AfterRepeated { parameter: previous.to_string() });
        }
        let (kind, is_repeated) = match kind.strip_suffix(REPEATED) {
            Some(kind) => (kind.trim_end(), true),
            None => (kind, false),
        };
        let (kind, range) = match kind.split_once(' ') {
            Some((kind, range)) => (kind, Some(range.trim_start())),
            None => (kind, None),
        };
        let kind = SignatureType::from_name(kind).map_err(|cause| (span_of(kind), cause))?;
        let range = match range {
            Some(text) => Some(range_of(kind, text).map_err(|cause| (span_of(text), cause))?),
            None => None,
        };
        list.push(Parameter { name: name.to_owned(), kind, range, is_repeated });
    }
    Ok(list)
}

/// Reads the least and the greatest value of a parameter.
fn range_of(kind: SignatureType, text: &str) -> Result<RangeInclusive<i32>, RobotFileCause> {
    let is_number = matches!(kind, SignatureType::Int | SignatureType::Number);
    // The parser of integers would take a plus.
    text.split_once(TO)
        .filter(|_| !text.contains('+'))
        .and_then(|(least, greatest)| Some(least.parse().ok()?..=greatest.parse().ok()?))
        .filter(|range| is_number && range.start() < range.end())
        .ok_or_else(|| RobotFileCause::BadRange { text: text.to_owned() })
}

/// Returns true if a script could use the text as a name; keywords are not checked.
pub fn is_identifier(text: &str) -> bool {
    let mut characters = text.chars();
    characters.next().is_some_and(|first| first.is_ascii_alphabetic() || first == '_')
        && characters.all(|c| c.is_ascii_alphanumeric() || c == '_')
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(text: &str) -> Vec<(String, SignatureType)> {
        parse_list(text).unwrap().into_iter().map(|p| (p.name, p.kind)).collect()
    }

    #[test]
    fn lists() {
        assert_eq!(names(""), []);
        assert_eq!(names("  "), []);
        assert_eq!(names("c:int"), [("c".to_owned(), SignatureType::Int)]);
        assert_eq!(
            names(" f : function ,x:any"),
            [("f".to_owned(), SignatureType::Function), ("x".to_owned(), SignatureType::Any)]
        );
        assert_eq!(names("a:int,b:int,c:int,d:int,e:int,f:int,g:int").len(), 7);
    }

    #[test]
    fn numbers_may_have_a_range() {
        let text = "a: int -100..100, b: number 0..7, c: int 1..2...";
        let list = parse_list(text).unwrap();
        let ranges: Vec<_> =
            list.iter().map(|parameter| parameter.range.clone().unwrap()).collect();
        assert_eq!(ranges, [-100..=100, 0..=7, 1..=2]);
        assert!(list[2].is_repeated);
        let shown: Vec<String> = list.iter().map(Parameter::to_string).collect();
        assert_eq!(shown.join(", "), text);
    }

    #[test]
    fn a_repeated_parameter_stands_for_any_number_of_arguments() {
        let list = parse_list("name: string, values: int ...").unwrap();
        let shown: Vec<String> = list.iter().map(Parameter::to_string).collect();
        assert_eq!(shown, ["name: string", "values: int..."]);
        let counts: Vec<usize> = (0..5).filter(|count| takes_count(&list, *count)).collect();
        assert_eq!(counts, [1, 2, 3, 4]);
        let kinds = [0, 1, 2, 100].map(|argument| parameter_at(&list, argument).unwrap().kind);
        assert_eq!(
            kinds,
            [SignatureType::String, SignatureType::Int, SignatureType::Int, SignatureType::Int]
        );
        let fixed = parse_list("name: string").unwrap();
        assert!(takes_count(&fixed, 1) && !takes_count(&fixed, 2));
        assert_eq!((parameter_at(&fixed, 1), parameter_at(&[], 0)), (None, None));
        assert!(takes_count(&[], 0) && !takes_count(&[], 1));
    }

    #[test]
    fn faults_and_their_place() {
        let cases = [
            ("color", 0..5, "BadParameter"),
            ("a: int,", 7..7, "BadParameter"),
            (",", 0..0, "BadParameter"),
            ("a: int, 2: int", 8..14, "BadParameter"),
            ("a: int, : int", 8..13, "BadParameter"),
            ("x:", 2..2, "UnknownType"),
            ("x: float32", 3..10, "UnknownType"),
            ("x: int: int", 3..7, "UnknownType"),
            ("x: int 5", 7..8, "BadRange"),
            ("x: int 0..", 7..10, "BadRange"),
            ("x: int 0..1.5", 7..13, "BadRange"),
            ("x: int 7..0", 7..11, "BadRange"),
            ("x: int 0..+7", 7..12, "BadRange"),
            ("x: int 0..99999999999", 7..21, "BadRange"),
            ("x: any 0..7", 7..11, "BadRange"),
            ("x: string 0..7...", 10..14, "BadRange"),
            ("x: int, x: int", 8..14, "RepeatedParameter"),
            ("a:int,b:int,c:int,d:int,e:int,f:int,g:int, h:int", 43..48, "TooManyParameters"),
            ("\u{e9}: int", 0..7, "BadParameter"),
            ("...", 0..3, "BadParameter"),
            ("x...: int", 0..9, "BadParameter"),
            ("x: ...", 3..3, "UnknownType"),
            ("x: itn...", 3..6, "UnknownType"),
            ("x: int..., y: int", 11..17, "AfterRepeated"),
            ("x: int..., y: int...", 11..20, "AfterRepeated"),
        ];
        for (text, place, cause) in cases {
            let (span, found) = parse_list(text).unwrap_err();
            assert_eq!(span, place, "{text}");
            assert!(format!("{found:?}").starts_with(cause), "{text}: {found:?}");
        }
    }
}
