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

use std::fmt;
use std::fs;
use std::path::Path;

use bittybuzz_toml_reader::{self as toml_reader, FileError, SourceText, TomlError};

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

/// A mistake in a manifest.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Cause {
    /// A mistake that any TOML file can have.
    Toml(TomlError),
    /// A text that is not pairs of hexadecimal digits.
    Hex { reason: String },
    /// A case that checks nothing in standard error.
    NoCheck,
}

impl From<TomlError> for Cause {
    fn from(error: TomlError) -> Self {
        Cause::Toml(error)
    }
}

impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Cause::Toml(error) => error.fmt(f),
            Cause::Hex { reason } => write!(f, "`hex` is wrong: {reason}"),
            Cause::NoCheck => write!(f, "`stderr` is empty"),
        }
    }
}

impl toml_reader::Cause for Cause {
    fn help(&self) -> Option<String> {
        match self {
            Cause::Toml(error) => error.help(),
            Cause::Hex { .. } => Some("pairs of digits and letters from a to f".to_string()),
            Cause::NoCheck => Some("a part of the message, such as its code".to_string()),
        }
    }
}

type Section<'a> = toml_reader::Section<'a, Cause>;
type Entry<'a> = toml_reader::TomlEntry<'a, Cause>;

const ROOT: &str = "the manifest";
const CASE: &str = "this [[case]]";

fn keys(section: &'static str) -> Vec<&'static str> {
    match section {
        ROOT => vec!["case"],
        _ => vec!["name", "script", "pieces", "hex", "extension", "args", "status", "stderr"],
    }
}

/// The cases of a manifest of the repository. Panics with all its mistakes.
pub fn load(path: &str) -> Vec<Case> {
    cases(path, &files::read(path)).unwrap_or_else(|errors| {
        let line = |error: &FileError<Cause>| {
            let line = error.place.as_ref().map_or(0, |place| place.line);
            format!("{path}:{line}: {error}; {}\n", error.help().unwrap_or_default())
        };
        panic!("\n{}", errors.iter().map(line).collect::<String>())
    })
}

fn cases(path: &str, text: &str) -> Result<Vec<Case>, Vec<FileError<Cause>>> {
    toml_reader::read(&SourceText::new(path, text), &[], (ROOT, &keys), |root| {
        root.required("case")?;
        let cases: Vec<Option<Case>> = root.sections("case", CASE).iter().map(case).collect();
        cases.into_iter().collect()
    })
}

fn case(section: &Section<'_>) -> Option<Case> {
    let name = section.required("name").and_then(|entry| entry.string());
    let extension = section.get("extension").map_or(Some("bzz"), |entry| entry.string());
    let file = ["script", "pieces", "hex"].iter().find_map(|key| section.get(key));
    let bytes = file.as_ref().map(|entry| match entry.key.as_str() {
        "script" => Some(entry.string()?.as_bytes().to_vec()),
        "pieces" => Some(pieces(entry)?.into_bytes()),
        _ => hex(entry),
    });
    let arguments = section
        .get("args")
        .map_or(Some(vec!["run".to_string(), "{file}".to_string()]), |entry| texts(&entry));
    let status = section.required("status").and_then(|entry| entry.integer(0..=255));
    let stderr = section.required("stderr").and_then(|entry| {
        let parts = texts(&entry)?;
        if parts.is_empty() {
            entry.fail(Cause::NoCheck);
        }
        Some(parts)
    });
    let file = match bytes {
        None => None,
        Some(bytes) => Some(File { extension: extension?.to_string(), bytes: bytes? }),
    };
    Some(Case {
        name: name?.to_string(),
        file,
        arguments: arguments?,
        status: status? as i32,
        stderr: stderr?,
    })
}

fn texts(entry: &Entry<'_>) -> Option<Vec<String>> {
    entry.list()?.iter().map(|item| item.string().map(str::to_string)).collect()
}

/// Texts, each with how often it is repeated.
fn pieces(entry: &Entry<'_>) -> Option<String> {
    let mut whole = String::new();
    for item in entry.list()? {
        let pair = item.list()?;
        let [piece, count] = pair.as_slice() else {
            let (key, found) = (item.key.clone(), pair.len());
            item.fail(TomlError::Length { key, expected: "a text and a number", found });
            return None;
        };
        whole.push_str(&piece.string()?.repeat(count.integer(0..=u32::MAX)? as usize));
    }
    Some(whole)
}

fn hex(entry: &Entry<'_>) -> Option<Vec<u8>> {
    bytes(entry.string()?).map_err(|reason| entry.fail(Cause::Hex { reason })).ok()
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

    fn one(text: &str) -> Result<Case, Vec<String>> {
        let read = cases("m.toml", &format!("[[case]]\n{text}"));
        let messages = |errors: Vec<FileError<Cause>>| {
            errors.iter().map(|error| error.cause.to_string()).collect()
        };
        read.map(|cases| cases[0].clone()).map_err(messages)
    }

    #[test]
    fn pieces_are_repeated() {
        let text = "name = 'x'\nstatus = 2\nstderr = ['E0101']\npieces = [['a', 3], ['b', 1]]\n";
        assert_eq!(one(text).unwrap().file.unwrap().bytes, b"aaab");
    }

    #[test]
    fn a_case_needs_something_to_check() {
        let missing = "this [[case]] has no `stderr`".to_string();
        assert_eq!(one("name = 'x'\nstatus = 2\n").unwrap_err(), [missing]);
        let case = one("name = 'x'\nstatus = 2\nstderr = ['E0101']\n").unwrap();
        assert_eq!((case.status, case.file), (2, None));
        let unknown = "unknown key `statuz` in this [[case]]".to_string();
        assert_eq!(one("name = 'x'\nstatuz = 2\nstderr = ['x']\n").unwrap_err(), [unknown]);
        let wrong = one("name = 3\nstatus = 2\nstderr = []\nhex = 'b'\n").unwrap_err();
        assert_eq!(wrong.len(), 3, "{wrong:?}");
    }
}
