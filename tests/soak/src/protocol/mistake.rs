//! The list of mistakes that cargo-mutants would make.

use anyhow::{Context, Result};
use serde::Deserialize;
use std::ops::Range;

/// A mistake in one place of a file.
#[derive(Deserialize)]
pub struct Mistake {
    /// The file from the root, line, column and change.
    pub name: String,
    /// The file from the root.
    pub file: String,
    /// The function around the place, with its comments and attributes; a constant has none.
    function: Option<Function>,
    span: Span,
    replacement: String,
}

#[derive(Deserialize)]
struct Function {
    span: Span,
}

#[derive(Deserialize)]
struct Span {
    start: Place,
    end: Place,
}

/// Both count from 1, columns in characters.
#[derive(Deserialize)]
struct Place {
    line: usize,
    column: usize,
}

/// A function and one mistake in it, as places in the text of the file.
pub struct Change<'a> {
    /// The body with its braces.
    pub body: Range<usize>,
    /// The place of the mistake, inside the body.
    pub place: Range<usize>,
    pub replacement: &'a str,
}

/// Reads the output of `cargo mutants --list --json`.
pub fn list(json: &str) -> Result<Vec<Mistake>> {
    serde_json::from_str(json).context("the list of mistakes is not as expected")
}

impl Mistake {
    /// Finds the mistake in the text of its file. `None` if the program cannot choose it at run time, because the compiler
    /// computes the value.
    pub fn find<'a>(&'a self, text: &str) -> Option<Change<'a>> {
        let function = self.function.as_ref()?.span.bytes(text)?;
        let place = self.span.bytes(text)?;
        let signature = function.start + signature(text.get(function.clone())?);
        let body = signature + text.get(signature..function.end)?.find('{')?..function.end;
        let is_computed = text.get(signature..body.start)?.contains("const fn ");
        let is_inside = body.start < place.start && place.end < body.end;
        (is_inside && !is_computed).then_some(Change {
            body,
            place,
            replacement: &self.replacement,
        })
    }
}

/// The number of bytes before the signature of a function: comments and attributes of one line.
fn signature(function: &str) -> usize {
    let is_before = |line: &&str| {
        let line = line.trim_start();
        line.starts_with("//") || line.starts_with("#[") || line.is_empty()
    };
    function.split_inclusive('\n').take_while(is_before).map(str::len).sum()
}

impl Span {
    fn bytes(&self, text: &str) -> Option<Range<usize>> {
        Some(self.start.byte(text)?..self.end.byte(text)?)
    }
}

impl Place {
    fn byte(&self, text: &str) -> Option<usize> {
        let before: usize =
            text.split_inclusive('\n').take(self.line.checked_sub(1)?).map(str::len).sum();
        let characters = text.get(before..)?.chars().take(self.column.checked_sub(1)?);
        Some(before + characters.map(char::len_utf8).sum::<usize>())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "/// Says {.\n#[inline]\nfn f(µ: u8) -> u8 {\n    µ + 1\n}\n";

    fn mistake(function: &str, line: usize, column: usize) -> Mistake {
        let json = format!(
            r#"[{{"name": "a.rs:4:7: replace + with -", "file": "a.rs", "replacement": "-", {function}
                "span": {{"start": {{"line": {line}, "column": {column}}}, "end": {{"line": {line}, "column": {}}}}}}}]"#,
            column + 1
        );
        list(&json).expect("the form of cargo-mutants").remove(0)
    }

    const FUNCTION: &str = r#""function": {"span": {"start": {"line": 1, "column": 1}, "end": {"line": 5, "column": 2}}},"#;

    #[test]
    fn a_mistake_is_found_in_the_body() {
        let mistake = mistake(FUNCTION, 4, 7);
        let change = mistake.find(TEXT).expect("a function at run time");
        assert_eq!((&TEXT[change.body], &TEXT[change.place]), ("{\n    µ + 1\n}", "+"));
        assert_eq!(change.replacement, "-");
    }

    #[test]
    fn computed_values_are_told_apart() {
        assert!(mistake(FUNCTION, 4, 7).find(&TEXT.replace("fn f", "const fn f")).is_none());
        assert!(mistake(r#""function": null,"#, 4, 7).find(TEXT).is_none());
        // A place before the body.
        assert!(mistake(FUNCTION, 3, 6).find(TEXT).is_none());
    }
}
