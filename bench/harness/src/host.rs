//! Callgrind: counts the instructions of a program on this computer.

use crate::error::BenchError;
use crate::marks::ReportedMark;
use anyhow::{Error, Result};
use bittybuzz_bench::Mark;
use bittybuzz_builds::shell::Invocation;
use fs_err as fs;
use std::path::Path;

pub const RUNNER: &str = "valgrind";

/// The function in which the program counts, and the one at whose calls counts are written and
/// cleared.
const FUNCTIONS: [&str; 2] = ["bench_host::counted", "bench_host::write_counts"];
/// The text before the count in a file of Callgrind.
const TOTALS: &str = "totals: ";
/// Runs the host's program with a script.
pub fn run(program: &Path, script: &Path, folder: &Path) -> Result<ReportedMark> {
    let script = script.display().to_string();
    let (printed, counts) = count(program, FUNCTIONS, &[&script], &[], folder)?;
    let (mark, value) = last_mark(&printed).ok_or_else(|| unexpected(printed.clone()))?;
    Ok(ReportedMark { counts, mark, value })
}

/// Runs a program, and returns what it prints and the counts that it writes. It counts in the first
/// of the functions, and writes at calls of the second.
pub fn count(
    program: &Path,
    functions: [&str; 2],
    arguments: &[&str],
    variables: &[(&str, &str)],
    folder: &Path,
) -> Result<(String, Vec<u64>)> {
    let out = folder.join("callgrind");
    let file = |number: u32| folder.join(format!("callgrind.{number}"));
    let files = || (1..).map(file).take_while(|path| path.exists());
    // An earlier run may have written more files.
    for path in files() {
        fs::remove_file(path)?;
    }
    let [counted, written] = functions;
    let options = [
        "--quiet".to_owned(),
        "--tool=callgrind".to_owned(),
        format!("--toggle-collect={counted}"),
        format!("--dump-before={written}"),
        format!("--callgrind-out-file={}", out.display()),
        program.display().to_string(),
    ];
    let all: Vec<&str> =
        options.iter().map(String::as_str).chain(arguments.iter().copied()).collect();
    let line = Invocation::new(RUNNER, &all).unannounced();
    let line = variables.iter().fold(line, |line, (name, value)| line.env(name, value));
    let output = line.output(0)?;
    let mut counts = Vec::new();
    for path in files() {
        let text = fs::read_to_string(&path)?;
        let count = text.lines().find_map(|line| line.strip_prefix(TOTALS));
        let count = count.and_then(|count| count.trim().parse().ok());
        counts.push(count.ok_or_else(|| unexpected(format!("no count in {}", path.display())))?);
    }
    Ok((String::from_utf8_lossy(&output.stdout).into_owned(), counts))
}

fn unexpected(what: String) -> Error {
    BenchError::Record { what }.into()
}

/// Parses the number of a mark, and its value.
fn last_mark(printed: &str) -> Option<(Mark, u32)> {
    let (mark, value) = printed.trim().split_once(' ')?;
    Some((Mark::numbered(mark.parse().ok()?)?, value.parse().ok()?))
}
