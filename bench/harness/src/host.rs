//! Callgrind: counts the instructions of a program on this computer.

use crate::error::BenchError;
use crate::marks::ReportedMark;
use anyhow::{Error, Result};
use bittybuzz_bench::Mark;
use bittybuzz_builds::shell::Invocation;
use fs_err as fs;
use std::path::Path;

pub const RUNNER: &str = "valgrind";

/// Options that count only in the first function, and write and clear the count at the second one.
const FUNCTIONS: [&str; 2] =
    ["--toggle-collect=bench_host::counted", "--dump-before=bench_host::write_counts"];
/// The text before the count in a file of Callgrind.
const TOTALS: &str = "totals: ";
/// The number of counts that are written.
const COUNTS: usize = 4;

/// Runs the host's program with a script.
pub fn run(program: &Path, script: &Path, folder: &Path) -> Result<ReportedMark> {
    let out = folder.join("callgrind");
    let file = |number| folder.join(format!("callgrind.{number}"));
    // An earlier run may have written more files.
    for number in 1..=COUNTS {
        let _ = fs::remove_file(file(number));
    }
    let text = |path: &Path| path.display().to_string();
    let (out, program, script) =
        (format!("--callgrind-out-file={}", text(&out)), text(program), text(script));
    let arguments =
        ["--quiet", "--tool=callgrind", FUNCTIONS[0], FUNCTIONS[1], &out, &program, &script];
    let output = Invocation::new(RUNNER, &arguments).unannounced().output(0)?;
    let printed = String::from_utf8_lossy(&output.stdout).into_owned();
    let (mark, value) = last_mark(&printed).ok_or_else(|| unexpected(printed.clone()))?;
    let mut counts = Vec::new();
    for path in (1..=COUNTS).map(file).filter(|path| path.exists()) {
        let text = fs::read_to_string(&path)?;
        let count = text.lines().find_map(|line| line.strip_prefix(TOTALS));
        let count = count.and_then(|count| count.trim().parse().ok());
        counts.push(count.ok_or_else(|| unexpected(format!("no count in {}", path.display())))?);
    }
    Ok(ReportedMark { counts, mark, value })
}

fn unexpected(what: String) -> Error {
    BenchError::Record { what }.into()
}

/// Parses the number of a mark, and its value.
fn last_mark(printed: &str) -> Option<(Mark, u32)> {
    let (mark, value) = printed.trim().split_once(' ')?;
    Some((Mark::numbered(mark.parse().ok()?)?, value.parse().ok()?))
}
