//! The compact notation for parameters and fields: `"x: number, y: number"`, and `"values: any..."`
//! for a variable number of arguments.

use crate::error::RobotFileCause;
use std::fmt;
use std::ops::Range;

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
    /// True for a last parameter that stands for any number of arguments, including none:
    /// `values: any...`.
    pub is_repeated: bool,
}

impl fmt::Display for Parameter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let dots = if self.is_repeated { REPEATED } else { "" };
        write!(f, "{}: {}{dots}", self.name, self.kind)
    }
}

/// The mark after the type of a repeated parameter.
const REPEATED: &str = "...";

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
        let kind = SignatureType::from_name(kind).map_err(|cause| (span_of(kind), cause))?;
        list.push(Parameter { name: name.to_owned(), kind, is_repeated });
    }
    Ok(list)
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
            ("x: int: int", 3..11, "UnknownType"),
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
