//! Arguments of `--set`: keys with one value or several.

use super::value::{RangeError, expand};
use super::{Axis, ParameterValue};

/// A reason why an argument of `--set` has no values.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SetError {
    /// The argument is not `KEY=VALUE`.
    #[error("`--set {0}` gives no value")]
    NoValue(String),
    /// A range without values.
    #[error(transparent)]
    Range(#[from] RangeError),
    /// Keys that vary together have different numbers of values.
    #[error("`{first}` has {first_count} values and `{other}` has {other_count}")]
    Lengths { first: String, first_count: usize, other: String, other_count: usize },
}

impl SetError {
    /// Returns the correction.
    pub fn help(&self) -> String {
        match self {
            SetError::NoValue(_) => "write it as `--set medium.ir.loss=0.1`".to_owned(),
            SetError::Range(_) => "write it as FIRST:LAST:STEP, for example 1:9:2".to_owned(),
            SetError::Lengths { .. } => {
                "keys that vary together need as many values; a `--set` of its own combines all values"
                    .to_owned()
            }
        }
    }
}

/// Parses an argument: `KEY=V1,V2` with values or ranges, or several of them with `;` between them,
/// whose keys vary together.
pub fn parse_set(argument: &str) -> Result<Axis, SetError> {
    let mut axis = Axis { keys: Vec::new(), rows: Vec::new() };
    for part in split(argument, ';') {
        let key_value = part.split_once('=').filter(|(key, _)| !key.trim().is_empty());
        let Some((key, values)) = key_value else {
            return Err(SetError::NoValue(argument.trim().to_owned()));
        };
        let lists = split(values, ',').into_iter().map(expand);
        let lists: Vec<Vec<ParameterValue>> = lists.collect::<Result<_, RangeError>>()?;
        let values: Vec<ParameterValue> = lists.into_iter().flatten().collect();
        match axis.keys.first() {
            None => axis.rows = vec![Vec::new(); values.len()],
            Some(first) if axis.rows.len() != values.len() => {
                return Err(SetError::Lengths {
                    first: first.clone(),
                    first_count: axis.rows.len(),
                    other: key.trim().to_owned(),
                    other_count: values.len(),
                });
            }
            Some(_) => {}
        }
        axis.keys.push(key.trim().to_owned());
        axis.rows.iter_mut().zip(values).for_each(|(row, value)| row.push(value));
    }
    Ok(axis)
}

/// Splits at separators that are outside brackets, braces and quotes.
fn split(values: &str, separator: char) -> Vec<&str> {
    let (mut parts, mut start, mut depth, mut quote) = (Vec::new(), 0, 0, None);
    for (at, c) in values.char_indices() {
        match (c, quote) {
            (_, Some(open)) if c == open => quote = None,
            (_, Some(_)) => {}
            ('"' | '\'', None) => quote = Some(c),
            ('[' | '{', None) => depth += 1,
            (']' | '}', None) => depth -= 1,
            (_, None) if c == separator && depth == 0 => {
                parts.push(&values[start..at]);
                start = at + c.len_utf8();
            }
            _ => {}
        }
    }
    parts.push(&values[start..]);
    parts.into_iter().map(str::trim).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(argument: &str) -> Vec<String> {
        let axis = parse_set(argument).unwrap();
        let setting = |row: &Vec<ParameterValue>| {
            let pairs = axis.keys.iter().zip(row);
            pairs.map(|(key, value)| format!("{key}={value}")).collect::<Vec<String>>().join(" ")
        };
        axis.rows.iter().map(setting).collect()
    }

    #[test]
    fn values_and_ranges_of_one_key() {
        assert_eq!(rows("a.b = 1, 2"), ["a.b=1", "a.b=2"]);
        assert_eq!(rows("a=1:3,9"), ["a=1", "a=2", "a=3", "a=9"]);
        assert_eq!(rows("a=[1,2],{ b = 3, c = ';' }"), ["a=[1,2]", "a={ b = 3, c = ';' }"]);
        assert_eq!(rows("a=\"x,y\",z=3"), ["a=x,y", "a=z=3"]);
        assert_eq!(rows("a="), ["a="]);
    }

    #[test]
    fn keys_that_vary_together() {
        assert_eq!(rows("a=1,2; b=x,y"), ["a=1 b=x", "a=2 b=y"]);
        assert_eq!(rows("a=1:3;b=0.1:0.3:0.1"), ["a=1 b=0.1", "a=2 b=0.2", "a=3 b=0.3"]);
    }

    #[test]
    fn mistakes() {
        for argument in ["a", "=1", "a=1;b", "a=1;", ""] {
            let error = parse_set(argument).unwrap_err();
            assert_eq!(error, SetError::NoValue(argument.to_owned()), "{argument}");
        }
        let error = parse_set("a=1,2;b=1").unwrap_err();
        assert_eq!(error.to_string(), "`a` has 2 values and `b` has 1");
        assert!(matches!(parse_set("a=9:1"), Err(SetError::Range(_))));
    }
}
