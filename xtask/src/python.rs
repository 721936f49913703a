//! The Python module of `python/`: lints, wheel, tests and types.

use anyhow::{Context, Result};
use bittybuzz_builds::cargo_test::{self, PYTHON};
use bittybuzz_builds::setup;
use bittybuzz_builds::shell::{Invocation, cargo, target};
use fs_err as fs;
use std::path::PathBuf;

use crate::checks::{CLIPPY, DENY};

/// Lints the module, builds its wheel, installs it into a Python of its own, and runs its tests, the
/// code of its guide, and the checks of its types there.
pub fn check() -> Result<()> {
    cargo(&[&CLIPPY[..], &["--package", PYTHON], &DENY].concat())?;
    let python = setup::python_module()?;
    // A wheel has the version of the module, so that pip takes an installed one for the same.
    let arguments =
        ["-m", "pip", "install", "--quiet", "--no-deps", "--no-index", "--force-reinstall"];
    let wheel = wheel(&python)?.display().to_string();
    let run = |arguments: &[&str]| Invocation::named("python3", &python, arguments);
    run(&[&arguments[..], &[&wheel]].concat()).run()?;
    // The tests compare with a `bbz` of the same profile.
    let bbz = cargo_test::bbz()?.display().to_string();
    run(&["-m", "pytest", "-q", "-p", "no:cacheprovider", "python/tests"])
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .env("BBZ", &bbz)
        .run()?;
    let cache = target()?.join("mypy").display().to_string();
    let settings = ["--strict", "--cache-dir", &cache];
    run(&[&["-m", "mypy"], &settings[..], &["python/tests"]].concat()).run()?;
    run(&["-m", "mypy.stubtest", "bittybuzz"]).env("MYPY_CACHE_DIR", &cache).run()
}

/// Builds the wheel in the profile of the tests. Returns its path.
fn wheel(python: &std::path::Path) -> Result<PathBuf> {
    let folder = target()?.join("wheels");
    if folder.is_dir() {
        // The folder has the wheel of each earlier version.
        fs::remove_dir_all(&folder)?;
    }
    let (out, interpreter) = (folder.display().to_string(), python.display().to_string());
    let arguments = ["build", "--locked", "--manifest-path", "python/Cargo.toml"];
    let options = ["--interpreter", &interpreter, "--out", &out];
    let maturin = python.with_file_name("maturin");
    Invocation::named("maturin", &maturin, &[&arguments[..], &options].concat()).run()?;
    let wheels = fs::read_dir(&folder)?.map(|entry| Ok(entry?.path()));
    let wheels = wheels.collect::<Result<Vec<PathBuf>>>()?;
    let is_wheel = |path: &PathBuf| path.extension().is_some_and(|end| end == "whl");
    wheels.into_iter().find(is_wheel).context("maturin has made no wheel")
}
