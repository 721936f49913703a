//! Input that `bbz` must refuse: bad scripts, images, robot files and command lines, listed in a manifest.
//!
//! ```toml
//! [[case]]
//! name = "what is wrong, in a few words"
//! script = "x = "              # or `hex`, the bytes of a file, or `pieces`; or none, for bad command lines
//! extension = "bbi"            # of that file; `bzz` if not given
//! args = ["run", "{file}"]     # this, if not given; `{file}` stands for the path
//! status = 2
//! stderr = ["E0201"]           # each must occur in standard error
//! ```
//!
//! `pieces = [["x = ", 1], ["(", 5000]]` is a text in pieces, each repeated so many times.

use std::fs;
use std::path::Path;

use toml::de::{DeTable, DeValue};

use crate::bbz;
use crate::files;
use crate::report::Failure;

/// A row of the manifest.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Case {
    name: String,
    file: Option<File>,
    arguments: Vec<String>,
    status: i32,
    stderr: Vec<String>,
}

#[derive(Debug, Clone, PartialEq, Eq)]
struct File {
    extension: String,
    bytes: Vec<u8>,
}

/// The cases of a manifest of the repository. Panics where it cannot be understood.
pub fn load(path: &str) -> Vec<Case> {
    let text = files::read(path);
    let manifest = DeTable::parse(&text).unwrap_or_else(|e| panic!("{path}: {e}"));
    let Some(DeValue::Array(rows)) = manifest.get_ref().get("case").map(|rows| rows.get_ref())
    else {
        panic!("{path}: no [[case]]");
    };
    rows.iter()
        .map(|row| match row.get_ref() {
            DeValue::Table(row) => case(row).unwrap_or_else(|e| panic!("{path}: {e}: {row:?}")),
            other => panic!("{path}: {other:?} is no case"),
        })
        .collect()
}

fn case(row: &DeTable) -> Result<Case, String> {
    let mut file = None;
    let mut case = Case {
        name: String::new(),
        file: None,
        arguments: vec!["run".to_string(), "{file}".to_string()],
        status: -1,
        stderr: Vec::new(),
    };
    let mut extension = "bzz".to_string();
    for (key, value) in row {
        let value = value.get_ref();
        match key.get_ref().as_ref() {
            "name" => case.name = text(value)?,
            "script" => file = Some(text(value)?.into_bytes()),
            "pieces" => file = Some(pieces(value)?.into_bytes()),
            "hex" => file = Some(bytes(&text(value)?)?),
            "extension" => extension = text(value)?,
            "args" => case.arguments = texts(value)?,
            "status" => case.status = number(value)?,
            "stderr" => case.stderr = texts(value)?,
            other => return Err(format!("unknown key `{other}`")),
        }
    }
    case.file = file.map(|bytes| File { extension, bytes });
    if case.name.is_empty() || case.status < 0 || case.stderr.is_empty() {
        return Err("name, status and stderr are needed".to_string());
    }
    Ok(case)
}

fn text(value: &DeValue) -> Result<String, String> {
    value.as_str().map(str::to_string).ok_or_else(|| format!("{value:?} is no string"))
}

fn texts(value: &DeValue) -> Result<Vec<String>, String> {
    match value {
        DeValue::Array(items) => items.iter().map(|item| text(item.get_ref())).collect(),
        other => Err(format!("{other:?} is no list of strings")),
    }
}

fn number(value: &DeValue) -> Result<i32, String> {
    match value {
        DeValue::Integer(digits) => {
            i32::from_str_radix(digits.as_str(), digits.radix()).map_err(|e| e.to_string())
        }
        other => Err(format!("{other:?} is no integer")),
    }
}

/// Texts, each with how often it is repeated.
fn pieces(value: &DeValue) -> Result<String, String> {
    let DeValue::Array(pieces) = value else {
        return Err(format!("{value:?} is no list of pieces"));
    };
    let mut whole = String::new();
    for piece in pieces.iter() {
        let DeValue::Array(pair) = piece.get_ref() else {
            return Err(format!("{piece:?} is no pair"));
        };
        let [piece, count] = &pair[..] else { return Err(format!("{pair:?} is no pair")) };
        let count = usize::try_from(number(count.get_ref())?).map_err(|e| e.to_string())?;
        whole.push_str(&text(piece.get_ref())?.repeat(count));
    }
    Ok(whole)
}

/// Pairs of hexadecimal digits; blanks between them and `#` comments do not count.
fn bytes(hex: &str) -> Result<Vec<u8>, String> {
    let digits: String = hex
        .lines()
        .map(|line| line.split('#').next().unwrap_or(""))
        .flat_map(|line| line.chars().filter(|c| !c.is_whitespace()))
        .collect();
    if !digits.len().is_multiple_of(2) {
        return Err("an odd number of hexadecimal digits".to_string());
    }
    (0..digits.len())
        .step_by(2)
        .map(|at| u8::from_str_radix(&digits[at..at + 2], 16).map_err(|e| e.to_string()))
        .collect()
}

/// Runs the case with its file in `folder`, and says what is not as it should be.
pub fn run(case: &Case, number: usize, folder: &Path) -> Option<Failure> {
    let mut path = String::new();
    if let Some(file) = &case.file {
        let target = folder.join(format!("case{number}.{}", file.extension));
        if let Err(e) = fs::write(&target, &file.bytes) {
            return Some(format!("{}: {e}\n", target.display()));
        }
        path = target.to_string_lossy().into_owned();
    }
    let arguments: Vec<String> =
        case.arguments.iter().map(|argument| argument.replace("{file}", &path)).collect();
    let outcome = bbz::run(&arguments, &[]);
    let mut problems = String::new();
    if outcome.status != Some(case.status) {
        problems.push_str(&format!(
            "    exit status {:?} instead of {}\n",
            outcome.status, case.status
        ));
    }
    for part in case.stderr.iter().filter(|part| !outcome.stderr.contains(part.as_str())) {
        problems.push_str(&format!("    standard error does not say `{part}`\n"));
    }
    if outcome.stderr.contains("panicked") {
        problems.push_str("    bbz panicked\n");
    }
    if problems.is_empty() {
        return None;
    }
    let said: String = outcome.stderr.lines().map(|line| format!("    | {line}\n")).collect();
    Some(format!("{}: bbz {}\n{problems}{said}", case.name, arguments.join(" ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hex_may_be_spaced_and_commented() {
        assert_eq!(bytes("b5 81 # magic\n00ff").unwrap(), [0xb5, 0x81, 0x00, 0xff]);
        assert!(bytes("b").is_err());
        assert!(bytes("zz").is_err());
    }

    #[test]
    fn pieces_are_repeated() {
        let table = DeTable::parse("p = [['a', 3], ['b', 1]]").unwrap();
        assert_eq!(pieces(table.get_ref()["p"].get_ref()).unwrap(), "aaab");
    }

    #[test]
    fn a_case_needs_something_to_check() {
        let table = DeTable::parse("name = 'x'\nstatus = 2\n").unwrap();
        assert!(case(table.get_ref()).is_err());
        let table = DeTable::parse("name = 'x'\nstatus = 2\nstderr = ['E0101']\n").unwrap();
        assert_eq!(case(table.get_ref()).unwrap().status, 2);
        let table = DeTable::parse("name = 'x'\nstatus = 2\nstderr = ['x']\nstatuz = 1").unwrap();
        assert!(case(table.get_ref()).is_err());
    }
}
