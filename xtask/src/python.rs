//! The Python module of `python/`: wheel, tests and types.

use anyhow::Result;
use bittybuzz_builds::shell::{Invocation, cargo, target};
use bittybuzz_builds::{cargo_test, python_module, setup};

/// Builds `bbz` alone and the wheel of the module, installs it into a Python of its own, and runs its tests, the
/// code of its guide, and the checks of its types there.
pub fn check() -> Result<()> {
    let python = setup::module_tests()?;
    python_module::install(&python, &python_module::tested(&python)?)?;
    // Users build `bbz` alone, with fewer features of shared crates than tests have. The wheel has compiled
    // nearly all of it with these.
    cargo(&["build", "--package", "bbz", "--lib"])?;
    let run = |arguments: &[&str]| Invocation::named("python3", &python, arguments);
    // The tests compare with a `bbz` of the same profile.
    let bbz = cargo_test::bbz()?.display().to_string();
    run(&["-m", "pytest", "-q", "-p", "no:cacheprovider", "python/tests"])
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .env("BBZ", &bbz)
        .run()?;
    let cache = target()?.join("mypy").display().to_string();
    let settings = ["--strict", "--cache-dir", &cache];
    run(&[&["-m", "mypy"], &settings[..], &["python/tests"]].concat()).run()?;
    let allowed = ["--allowlist", "python/stubtest.txt"];
    run(&[&["-m", "mypy.stubtest"], &allowed[..], &["bittybuzz"]].concat())
        .env("MYPY_CACHE_DIR", &cache)
        .run()
}
