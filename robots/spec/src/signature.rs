//! The compact notation for parameters and fields: `"x: number, y: number"`.

use crate::error::Cause;
use std::fmt;
use std::ops::Range;

/// The most arguments that a call of a robot function can pass.
pub const MAX_PARAMETERS: usize = 7;

/// What a parameter accepts, what a function returns or what a field holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Type {
    /// An integer.
    Int,
    /// As a parameter an int or a float; as a result or a field a float.
    Number,
    /// A string.
    String,
    /// A table.
    Table,
    /// A function.
    Function,
    /// Any value, nil included.
    Any,
}

impl Type {
    /// Every type.
    pub const ALL: [Type; 6] =
        [Type::Int, Type::Number, Type::String, Type::Table, Type::Function, Type::Any];

    /// Its name in robot files.
    pub const fn name(self) -> &'static str {
        match self {
            Type::Int => "int",
            Type::Number => "number",
            Type::String => "string",
            Type::Table => "table",
            Type::Function => "function",
            Type::Any => "any",
        }
    }

    pub(crate) fn from_name(name: &str) -> Result<Type, Cause> {
        Type::ALL
            .into_iter()
            .find(|kind| kind.name() == name)
            .ok_or_else(|| Cause::UnknownType { name: name.to_owned() })
    }
}

impl fmt::Display for Type {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A parameter of a function, or a field of a table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Parameter {
    /// Its name, for messages and documentation.
    pub name: String,
    /// What it accepts or holds.
    pub kind: Type,
}

impl fmt::Display for Parameter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.name, self.kind)
    }
}

/// What is wrong in a list, and where in it (bytes).
pub type ListError = (Range<usize>, Cause);

/// Reads a list of parameters. An empty or blank text is the empty list.
pub fn parse_list(text: &str) -> Result<Vec<Parameter>, ListError> {
    let mut list: Vec<Parameter> = Vec::new();
    if text.trim().is_empty() {
        return Ok(list);
    }
    // Every part is a slice of `text`, so its address tells where it stands.
    let span_of = |part: &str| {
        let start = part.as_ptr().addr() - text.as_ptr().addr();
        start..start + part.len()
    };
    for item in text.split(',').map(str::trim) {
        let fail = |cause| Err((span_of(item), cause));
        let Some((name, kind)) = item.split_once(':') else {
            return fail(Cause::BadParameter { text: item.to_owned() });
        };
        let (name, kind) = (name.trim(), kind.trim());
        if !is_identifier(name) {
            return fail(Cause::BadParameter { text: item.to_owned() });
        }
        if list.iter().any(|other| other.name == name) {
            return fail(Cause::RepeatedParameter { name: name.to_owned() });
        }
        if list.len() == MAX_PARAMETERS {
            return fail(Cause::TooManyParameters);
        }
        let kind = Type::from_name(kind).map_err(|cause| (span_of(kind), cause))?;
        list.push(Parameter { name: name.to_owned(), kind });
    }
    Ok(list)
}

/// Whether a script could use the text as a name, keywords aside.
pub fn is_identifier(text: &str) -> bool {
    let mut characters = text.chars();
    characters.next().is_some_and(|first| first.is_ascii_alphabetic() || first == '_')
        && characters.all(|c| c.is_ascii_alphanumeric() || c == '_')
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(text: &str) -> Vec<(String, Type)> {
        parse_list(text).unwrap().into_iter().map(|p| (p.name, p.kind)).collect()
    }

    #[test]
    fn lists() {
        assert_eq!(names(""), []);
        assert_eq!(names("  "), []);
        assert_eq!(names("c:int"), [("c".to_owned(), Type::Int)]);
        assert_eq!(
            names(" f : function ,x:any"),
            [("f".to_owned(), Type::Function), ("x".to_owned(), Type::Any)]
        );
        assert_eq!(names("a:int,b:int,c:int,d:int,e:int,f:int,g:int").len(), 7);
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
        ];
        for (text, place, cause) in cases {
            let (span, found) = parse_list(text).unwrap_err();
            assert_eq!(span, place, "{text}");
            assert!(format!("{found:?}").starts_with(cause), "{text}: {found:?}");
        }
    }
}
