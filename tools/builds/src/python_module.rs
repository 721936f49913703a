//! The wheel of the Python module.

use crate::programs::{PROFILE, Platform};
use crate::setup;
use crate::shell::{Invocation, target};
use anyhow::{Context, Result};
use fs_err as fs;
use std::path::{Path, PathBuf};

/// Installs a wheel of the module into a Python.
pub fn install(python: &Path, wheel: &Path) -> Result<()> {
    // A wheel has the version of the module, so that pip takes an installed one for the same.
    let arguments =
        ["-m", "pip", "install", "--quiet", "--no-deps", "--no-index", "--force-reinstall"];
    let wheel = wheel.display().to_string();
    Invocation::named("pip", python, &[&arguments[..], &[&wheel]].concat()).run()
}

/// The option that compiles shared crates with the features of tests, which have compiled them already.
pub const TESTED: [&str; 2] = ["--features", "tested"];

/// Builds the wheel for tests, in their profile, with the `maturin` of a Python. Returns its path.
pub fn tested(python: &Path) -> Result<PathBuf> {
    let interpreter = python.display().to_string();
    let options = [&TESTED[..], &["--interpreter", &interpreter]].concat();
    wheel(|arguments| maturin(python, arguments), &options)
}

/// Builds the wheel that is downloaded, for a platform or for this computer. Returns its path.
pub fn release(platform: Option<&'static Platform>) -> Result<PathBuf> {
    let python = setup::packers()?;
    let profile = ["--profile", PROFILE];
    let Some(platform) = platform else {
        return wheel(|arguments| maturin(&python, arguments), &profile);
    };
    let options = [&profile[..], &platform.wheel_options()?].concat();
    wheel(|arguments| platform.with_linker(maturin(&python, arguments), &python), &options)
}

/// Returns the command of the `maturin` next to a Python.
fn maturin(python: &Path, arguments: &[&str]) -> Invocation {
    Invocation::named("maturin", &python.with_file_name("maturin"), arguments)
}

/// Builds the wheel with the command that `maturin` returns for arguments. Returns its path.
fn wheel(maturin: impl FnOnce(&[&str]) -> Invocation, options: &[&str]) -> Result<PathBuf> {
    let folder = target()?.join("wheels");
    if folder.is_dir() {
        // The folder has the wheel of each earlier version.
        fs::remove_dir_all(&folder)?;
    }
    let out = folder.display().to_string();
    let arguments = ["build", "--locked", "--manifest-path", "python/Cargo.toml", "--out", &out];
    maturin(&[&arguments[..], options].concat()).run()?;
    let wheels = fs::read_dir(&folder)?.map(|entry| Ok(entry?.path()));
    let wheels = wheels.collect::<Result<Vec<PathBuf>>>()?;
    let is_wheel = |path: &PathBuf| path.extension().is_some_and(|end| end == "whl");
    wheels.into_iter().find(is_wheel).context("maturin has made no wheel")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shell::root;

    /// pip builds the module with the version in `pyproject.toml`, the tests and the releases with
    /// those of their lists.
    #[test]
    fn one_version_of_maturin_builds_all_wheels() {
        let files =
            ["python/pyproject.toml", "python/requirements.txt", "tools/builds/requirements.txt"];
        let versions = files.map(|file| {
            let text = fs::read_to_string(root().join(file)).unwrap();
            let (_, rest) = text.split_once("maturin==").unwrap();
            rest.split(|c: char| c != '.' && !c.is_ascii_digit()).next().unwrap().to_owned()
        });
        assert!(versions.iter().all(|version| *version == versions[0]), "{versions:?}");
    }
}
