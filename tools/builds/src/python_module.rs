//! The wheel of the Python module.

use crate::shell::{Invocation, target};
use anyhow::{Context, Result};
use fs_err as fs;
use std::path::{Path, PathBuf};

/// Builds the wheel with the `maturin` of a Python, and installs it there. `profile` has options of
/// cargo's profile; there are none for that of the tests.
pub fn install(python: &Path, profile: &[&str]) -> Result<()> {
    // A wheel has the version of the module, so that pip takes an installed one for the same.
    let arguments =
        ["-m", "pip", "install", "--quiet", "--no-deps", "--no-index", "--force-reinstall"];
    let wheel = wheel(python, profile)?.display().to_string();
    Invocation::named("pip", python, &[&arguments[..], &[&wheel]].concat()).run()
}

/// Builds the wheel. Returns its path.
fn wheel(python: &Path, profile: &[&str]) -> Result<PathBuf> {
    let folder = target()?.join("wheels");
    if folder.is_dir() {
        // The folder has the wheel of each earlier version.
        fs::remove_dir_all(&folder)?;
    }
    let (out, interpreter) = (folder.display().to_string(), python.display().to_string());
    let arguments = ["build", "--locked", "--manifest-path", "python/Cargo.toml"];
    let options = ["--interpreter", &interpreter, "--out", &out];
    let maturin = python.with_file_name("maturin");
    Invocation::named("maturin", &maturin, &[&arguments[..], &options, profile].concat()).run()?;
    let wheels = fs::read_dir(&folder)?.map(|entry| Ok(entry?.path()));
    let wheels = wheels.collect::<Result<Vec<PathBuf>>>()?;
    let is_wheel = |path: &PathBuf| path.extension().is_some_and(|end| end == "whl");
    wheels.into_iter().find(is_wheel).context("maturin has made no wheel")
}
