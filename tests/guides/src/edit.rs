//! Changes to a file.

use std::fmt;

/// A change.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Edit {
    /// The file is new.
    New(String),
    /// More at its end.
    Append(String),
    /// More below the line with this text.
    After(String, String),
    /// More above the line with this text.
    Before(String, String),
    /// Lines as in a diff: ` ` stays, `-` goes, `+` comes; `@@` is between two places.
    Patch(String),
}

/// Why a change does not fit its file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum EditError {
    /// The file is not there.
    Missing,
    /// The new file is there already.
    Exists,
    /// Not one place with these lines, but so many.
    Places { wanted: String, count: usize },
}

impl fmt::Display for EditError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            EditError::Missing => f.write_str("does not exist"),
            EditError::Exists => f.write_str("exists already"),
            EditError::Places { wanted, count: 0 } => write!(f, "has nowhere\n{wanted}"),
            EditError::Places { wanted, count } => write!(f, "has in {count} places\n{wanted}"),
        }
    }
}

impl Edit {
    /// The file after the change; `before` is `None` if there is no such file.
    pub fn apply(&self, before: Option<&str>) -> Result<String, EditError> {
        match (self, before) {
            (Edit::New(text), None) => Ok(text.clone()),
            (Edit::New(_), Some(_)) => Err(EditError::Exists),
            (_, None) => Err(EditError::Missing),
            (Edit::Append(text), Some(before)) => Ok(format!("{before}{text}")),
            (Edit::After(anchor, text), Some(before)) => insert(before, anchor, 1, text),
            (Edit::Before(anchor, text), Some(before)) => insert(before, anchor, 0, text),
            (Edit::Patch(text), Some(before)) => {
                let lines: Vec<&str> = text.lines().collect();
                let places = lines.split(|line| *line == "@@");
                places.into_iter().try_fold(before.to_owned(), |text, place| patch(&text, place))
            }
        }
    }
}

fn insert(text: &str, anchor: &str, below: usize, more: &str) -> Result<String, EditError> {
    let lines: Vec<&str> = text.lines().collect();
    let at = only(anchor, (0..lines.len()).filter(|at| lines[*at].contains(anchor)))? + below;
    Ok(joined([&lines[..at], &more.lines().collect::<Vec<_>>(), &lines[at..]]))
}

fn patch(text: &str, change: &[&str]) -> Result<String, EditError> {
    // Editors take the space of an empty line away.
    let side = |other: char| -> Vec<&str> {
        change
            .iter()
            .filter(|line| !line.starts_with(other))
            .map(|line| line.get(1..).unwrap_or(""))
            .collect()
    };
    let (old, new) = (side('+'), side('-'));
    let lines: Vec<&str> = text.lines().collect();
    let places = lines.windows(old.len().max(1)).enumerate().filter(|(_, window)| *window == old);
    let at = only(&old.join("\n"), places.map(|(at, _)| at))?;
    Ok(joined([&lines[..at], &new, &lines[at + old.len()..]]))
}

fn only(wanted: &str, places: impl Iterator<Item = usize>) -> Result<usize, EditError> {
    let places: Vec<usize> = places.collect();
    match places[..] {
        [at] => Ok(at),
        _ => Err(EditError::Places { wanted: wanted.to_owned(), count: places.len() }),
    }
}

fn joined(parts: [&[&str]; 3]) -> String {
    parts.concat().iter().map(|line| format!("{line}\n")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: &str = "one {\n  two\n}\n\nthree {\n  two\n}\n";

    fn apply(edit: Edit) -> Result<String, EditError> {
        edit.apply(Some(FILE))
    }

    #[test]
    fn changes_that_fit() {
        let more = || "  x\n".to_owned();
        let after = apply(Edit::After("three".to_owned(), more()));
        assert_eq!(after.as_deref(), Ok("one {\n  two\n}\n\nthree {\n  x\n  two\n}\n"));
        let before = apply(Edit::Before("one".to_owned(), more()));
        assert_eq!(before, Ok(format!("  x\n{FILE}")));
        assert_eq!(apply(Edit::Append(more())), Ok(format!("{FILE}  x\n")));
        let patch = " one {\n-  two\n+  2\n }\n\n@@\n three {\n+  x\n";
        let patched = apply(Edit::Patch(patch.to_owned()));
        assert_eq!(patched.as_deref(), Ok("one {\n  2\n}\n\nthree {\n  x\n  two\n}\n"));
        assert_eq!(Edit::New(more()).apply(None), Ok(more()));
    }

    #[test]
    fn changes_that_do_not_fit() {
        let places =
            |wanted: &str, count| Err(EditError::Places { wanted: wanted.to_owned(), count });
        let more = String::new;
        assert_eq!(apply(Edit::After("two".to_owned(), more())), places("two", 2));
        assert_eq!(apply(Edit::Before("four".to_owned(), more())), places("four", 0));
        assert_eq!(apply(Edit::Patch("-  two\n }\n".to_owned())), places("  two\n}", 2));
        assert_eq!(apply(Edit::Patch("+four\n".to_owned())), places("", 0));
        assert_eq!(apply(Edit::New(more())), Err(EditError::Exists));
        assert_eq!(Edit::Append(more()).apply(None), Err(EditError::Missing));
    }
}
