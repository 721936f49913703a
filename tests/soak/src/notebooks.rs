//! Runs the notebooks of the book with the wheel of the Python module, and compares their figures.

use crate::Verdict;
use anyhow::{Context, Result};
use bittybuzz_builds::setup;
use bittybuzz_builds::shell::{Invocation, root};
use fs_err as fs;

/// The folder of the notebooks, from the root.
const FOLDER: &str = "docs/notebooks";

/// The item for the page in a notebook.
const PAGE: &str = "the page in JupyterLab";

/// Path prefixes of the files that the notebooks are about.
pub const MADE_OF: &[&str] = &[
    "Cargo",
    "arena/src/",
    "bbz/page/",
    "comms/src/",
    "compiler/src/",
    "docs/notebooks/",
    "live/src/",
    "python/",
    "robots/",
    "spec/",
    "tests/notebooks/",
    "vm-core/src/",
];

/// Returns the names of the notebooks, and the page.
pub fn items() -> Vec<String> {
    let entries = fs::read_dir(root().join(FOLDER)).expect("the repository has this folder");
    let names = entries.map(|entry| entry.expect("a folder can be read").file_name());
    let names = names.filter_map(|name| name.into_string().ok());
    let mut names: Vec<String> = names.filter(|name| name.ends_with(".ipynb")).collect();
    names.sort();
    names.push(PAGE.to_owned());
    names
}

/// Runs a notebook, or the page.
pub fn run(item: &str) -> Result<Verdict> {
    let python = setup::notebooks()?;
    let program = if item == PAGE { "page.py" } else { "run.py" };
    let program = format!("tests/notebooks/{program}");
    let notebook = format!("{FOLDER}/{item}");
    let arguments: &[&str] = if item == PAGE { &[] } else { &[&notebook] };
    let command = Invocation::named("python3", &python, &[&[program.as_str()], arguments].concat());
    let output = command.output_if(|output| output.status.code().is_some())?;
    let printed = String::from_utf8_lossy(&output.stdout).into_owned();
    Ok(match output.status.success() {
        true => Verdict::Shown(printed.lines().last().context("it prints a line")?.to_owned()),
        false => Verdict::Missing(printed + &String::from_utf8_lossy(&output.stderr)),
    })
}
