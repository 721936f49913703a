//! The work of the readers of files: an input of twice the length takes about twice the instructions.

use crate::error::BenchError;
use crate::host;
use anyhow::Result;
use bittybuzz_builds::cargo_test::all_tests;
use bittybuzz_builds::shell::{is_installed, target};
use fs_err as fs;
use serde_json::Value;
use std::path::{Path, PathBuf};

/// The module of bbz whose tests read inputs of many shapes, see its documentation.
const TESTS: &str = "proportion::";
/// The names of its functions, see [`host::count`].
const FUNCTIONS: [&str; 2] =
    ["bbz_tool::proportion::counted", "bbz_tool::proportion::write_counts"];
/// The variable with which the tests count.
const COUNTED: &str = "BITTYBUZZ_COUNTED";
/// The first word of a line about a count, before the length of the input and its shape.
const WORD: &str = "counted ";

/// The largest growth of the instructions when the input doubles. Sorting takes a little more than
/// 2.
const GROWTH_MAX: f64 = 2.3;
/// Instructions for any input, such as those of a message.
const CONSTANT: f64 = 1e6;

/// The work for an input.
struct Work {
    shape: String,
    bytes: u64,
    instructions: u64,
}

/// Counts, and prints the counts.
pub fn run() -> Result<()> {
    let excesses = check()?;
    if excesses.is_empty() { Ok(()) } else { Err(BenchError::Grown(excesses).into()) }
}

/// Counts, prints the counts, and returns the shapes of inputs whose work grows too much.
pub fn check() -> Result<Vec<String>> {
    eprintln!("bench: readers");
    if !is_installed(host::RUNNER) {
        return Err(BenchError::Missing { program: host::RUNNER }.into());
    }
    let folder = target()?.join("bench");
    fs::create_dir_all(&folder)?;
    let works = measure(&test_program()?, &folder)?;
    let mut excesses = Vec::new();
    println!(
        "{:<36}{:>10}{:>14}{:>14}{:>8}",
        "input", "bytes", "instructions", "of twice", "growth"
    );
    for pair in works.chunks(2) {
        let [one, two] = pair else { break };
        let growth = two.instructions as f64 / one.instructions as f64;
        let Work { shape, bytes, instructions } = one;
        println!("{shape:<36}{bytes:>10}{instructions:>14}{:>14}{growth:>8.2}", two.instructions);
        if two.instructions as f64 > GROWTH_MAX * one.instructions as f64 + CONSTANT {
            excesses.push(format!(
                "{shape}: {bytes} bytes take {instructions} instructions, {} bytes take {}",
                two.bytes, two.instructions
            ));
        }
    }
    Ok(excesses)
}

fn measure(program: &Path, folder: &Path) -> Result<Vec<Work>> {
    let arguments = [TESTS, "--test-threads=1", "--nocapture"];
    let (printed, counts) = host::count(program, FUNCTIONS, &arguments, &[(COUNTED, "1")], folder)?;
    // The name of a test may stand before the first line that it prints.
    let lines = printed.lines().filter_map(|line| line.split_once(WORD));
    let lines: Vec<(u64, &str)> = lines
        .filter_map(|(_, rest)| {
            let (bytes, shape) = rest.split_once(' ')?;
            Some((bytes.parse().ok()?, shape))
        })
        .collect();
    let is_whole = lines.len() == counts.len() && !counts.is_empty();
    let what = format!("{} inputs and {} counts", lines.len(), counts.len());
    let unexpected = || BenchError::Record { what };
    let works = lines.into_iter().zip(counts).map(|((bytes, shape), instructions)| Work {
        shape: shape.to_owned(),
        bytes,
        instructions,
    });
    is_whole.then(|| works.collect()).ok_or_else(|| unexpected().into())
}

/// Builds the tests of libraries with all that is shared by builds of tests. Returns the program of bbz.
fn test_program() -> Result<PathBuf> {
    let options = ["--lib", "--no-run", "--message-format", "json-render-diagnostics"];
    let messages = all_tests(&options, &[]).unannounced().shown_errors()?;
    let executable = |line: &str| {
        let message: Value = serde_json::from_str(line).ok()?;
        let is_test = message["target"]["name"] == "bbz_tool" && message["profile"]["test"] == true;
        is_test.then(|| message["executable"].as_str().map(PathBuf::from)).flatten()
    };
    let what = "cargo names no test program of bbz".to_owned();
    messages.lines().find_map(executable).ok_or_else(|| BenchError::Record { what }.into())
}
