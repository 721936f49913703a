//! The recorded differences from Buzz: `compatibility/differences.toml`, which backs the tables of COMPATIBILITY.md.
//!
//! ```toml
//! [[case]]
//! point = "the first cell of the row, exactly"
//! script = "log(1 < 2)"
//! buzz = "refuses"        # or `prints` (everything to the end), `stops` (an error at run time), `crashes` (a signal)
//! buzz_output = "..."     # with `prints` only
//! here = "prints"         # or `stops`, `refuses`
//! here_output = "..."     # with `prints` only
//! here_code = "E0401"     # else
//! as_buzz = true          # the row is about BittyBuzz only, so both results must be equal
//!
//! [[no_case]]
//! point = "a row without a script"
//! reason = "the reason"
//!
//! [[family]]              # differences of `crate::arguments`
//! point = "the first cell of the row, or a sentence of COMPATIBILITY.md"
//! of = ["math.min", "<"]  # functions and operators; every one if left out
//! here = "R0008"          # the code of the error here, or `prints`
//! ```

use std::fmt;

use bittybuzz_toml_reader::{self as toml_reader, FileError, SourceText, TomlError};

use crate::bbz::Outcome;
use crate::files;

/// The end of a run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum End {
    /// It printed this, and ended without an error.
    Prints(String),
    /// A run-time error stopped it; the code, which Buzz does not have.
    Stops(String),
    /// The compiler refused it; the code, which Buzz does not have.
    Refuses(String),
    /// A signal ended the process.
    Crashes,
}

impl End {
    /// Equality of behavior: codes and messages do not count.
    pub fn is_like(&self, other: &End) -> bool {
        match (self, other) {
            (End::Prints(a), End::Prints(b)) => a == b,
            (a, b) => std::mem::discriminant(a) == std::mem::discriminant(b),
        }
    }

    /// The end of a run of `bbz run`.
    pub fn of_bbz(outcome: &Outcome) -> End {
        match outcome.status {
            Some(0) => End::Prints(outcome.stdout.trim_end().to_string()),
            Some(1) => End::Stops(code(&outcome.stderr)),
            Some(_) => End::Refuses(code(&outcome.stderr)),
            None => End::Crashes,
        }
    }
}

/// The code of the first error in this text.
fn code(text: &str) -> String {
    let rest = text.split("error[").nth(1).unwrap_or_default();
    rest.split(']').next().unwrap_or_default().to_string()
}

impl fmt::Display for End {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            End::Prints(output) => write!(f, "prints {output:?}"),
            End::Stops(code) => write!(f, "stops {code}"),
            End::Refuses(code) => write!(f, "refuses {code}"),
            End::Crashes => f.write_str("crashes"),
        }
    }
}

/// A script and its results.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Case {
    pub point: String,
    pub script: String,
    pub buzz: End,
    pub here: End,
    /// The row is about BittyBuzz only.
    pub as_buzz: bool,
}

/// Differences that many arguments of functions and operators show.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Family {
    pub point: String,
    /// Functions and operators; every one if it is empty.
    pub of: Vec<String>,
    /// The code of the error here, or `prints`.
    pub here: String,
}

impl Family {
    /// Returns true if this end of a script about a function or an operator belongs to it.
    pub fn explains(&self, of: &str, here: &End) -> bool {
        let end = match here {
            End::Prints(_) => "prints",
            End::Stops(code) | End::Refuses(code) => code,
            End::Crashes => return false,
        };
        self.here == end && (self.of.is_empty() || self.of.iter().any(|name| name == of))
    }
}

/// The file: its cases, the points without a case, and the families.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Differences {
    pub cases: Vec<Case>,
    pub no_case: Vec<String>,
    pub families: Vec<Family>,
}

type Section<'a> = toml_reader::Section<'a, TomlError>;

const ROOT: &str = "the file";
const CASE: &str = "this [[case]]";
const NO_CASE: &str = "this [[no_case]]";
const FAMILY: &str = "this [[family]]";

fn keys(section: &'static str) -> Vec<&'static str> {
    match section {
        ROOT => vec!["case", "no_case", "family"],
        FAMILY => vec!["point", "of", "here"],
        NO_CASE => vec!["point", "reason"],
        _ => vec![
            "point",
            "script",
            "buzz",
            "buzz_output",
            "here",
            "here_output",
            "here_code",
            "as_buzz",
        ],
    }
}

/// Reads the file of the repository. Panics with all its mistakes.
pub fn load(path: &str) -> Differences {
    let text = files::read(path);
    let read = toml_reader::read(&SourceText::new(path, &text), &[], (ROOT, &keys), |root| {
        let cases: Vec<_> = root.sections("case", CASE).iter().map(case).collect();
        let no_case: Vec<_> = root.sections("no_case", NO_CASE).iter().map(no_case).collect();
        let families: Vec<_> = root.sections("family", FAMILY).iter().map(family).collect();
        Some(Differences {
            cases: cases.into_iter().collect::<Option<_>>()?,
            no_case: no_case.into_iter().collect::<Option<_>>()?,
            families: families.into_iter().collect::<Option<_>>()?,
        })
    });
    read.unwrap_or_else(|errors: Vec<FileError<TomlError>>| {
        let line = |error: &FileError<TomlError>| {
            let line = error.place.as_ref().map_or(0, |place| place.line);
            format!("{path}:{line}: {error}\n")
        };
        panic!("\n{}", errors.iter().map(line).collect::<String>())
    })
}

fn case(section: &Section<'_>) -> Option<Case> {
    let text = |key| section.required(key)?.string().map(str::to_string);
    let as_buzz = match section.get("as_buzz") {
        Some(entry) => entry.boolean()?,
        None => false,
    };
    Some(Case {
        point: text("point")?,
        script: text("script")?,
        buzz: end(section, "buzz", "buzz_output", None)?,
        here: end(section, "here", "here_output", Some("here_code"))?,
        as_buzz,
    })
}

fn no_case(section: &Section<'_>) -> Option<String> {
    section.required("reason")?.string()?;
    section.required("point")?.string().map(str::to_string)
}

fn family(section: &Section<'_>) -> Option<Family> {
    let text = |key| section.required(key)?.string().map(str::to_string);
    let of = match section.get("of") {
        Some(entry) => {
            let names = entry.list()?;
            names.iter().map(|name| name.string().map(str::to_string)).collect::<Option<_>>()?
        }
        None => Vec::new(),
    };
    Some(Family { point: text("point")?, of, here: text("here")? })
}

fn end(
    section: &Section<'_>,
    key: &'static str,
    output: &'static str,
    code: Option<&'static str>,
) -> Option<End> {
    let entry = section.required(key)?;
    let code = || match code {
        Some(code) => section.required(code)?.string().map(str::to_string),
        None => Some(String::new()),
    };
    // The words of an end; its output or code are keys of their own.
    #[derive(Clone, Copy)]
    enum Word {
        Prints,
        Stops,
        Refuses,
        Crashes,
    }
    let words = [
        ("prints", Word::Prints),
        ("stops", Word::Stops),
        ("refuses", Word::Refuses),
        ("crashes", Word::Crashes),
    ];
    Some(match entry.word(&words)? {
        Word::Prints => End::Prints(section.required(output)?.string()?.trim_end().to_string()),
        Word::Stops => End::Stops(code()?),
        Word::Refuses => End::Refuses(code()?),
        Word::Crashes => End::Crashes,
    })
}

/// The points of a page: the first cells of the tables whose heading has the columns `Point` and `Buzz`.
pub fn points(page: &str) -> Vec<String> {
    let mut points = Vec::new();
    let mut inside = false;
    for line in page.lines() {
        if !line.starts_with('|') {
            inside = false;
        } else if line.starts_with("| Point | Buzz |") {
            inside = true;
        } else if inside && !line.starts_with("|---") {
            points.push(first_cell(line));
        }
    }
    points
}

/// The text up to the first `|` that no backslash precedes.
fn first_cell(row: &str) -> String {
    let row = row.trim_start_matches('|');
    let bytes = row.as_bytes();
    let end =
        (0..bytes.len()).find(|&at| bytes[at] == b'|' && bytes[at.saturating_sub(1)] != b'\\');
    row[..end.unwrap_or(row.len())].trim().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_the_first_cells_of_tables_about_buzz() {
        let page = "| Limit | Value |\n|---|---|\n| levels | 200 |\n\n| Point | Buzz | Here |\n|---|---|---|\n\
                    | `&`, `\\|` | bitwise | the same |\n";
        assert_eq!(points(page), ["`&`, `\\|`"]);
    }

    #[test]
    fn codes_and_messages_do_not_count() {
        assert!(End::Stops("R0001".to_string()).is_like(&End::Stops(String::new())));
        assert!(!End::Prints("1".to_string()).is_like(&End::Prints("2".to_string())));
        assert!(!End::Crashes.is_like(&End::Stops(String::new())));
    }
}
