//! The shipped examples do what their headers say, on every robot that they name.

use std::fs;
use std::path::Path;

use bittybuzz_tests::{bbz, diagnostics, example, files, report};

#[test]
fn examples_reach_their_stated_results() {
    bbz::path();
    let mut paths = files::with_extension("examples", "bzz");
    paths.retain(|path| !path.starts_with("examples/errors/"));
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("examples");
    fs::create_dir_all(&folder).unwrap();
    let failures: Vec<_> = files::in_parallel(&paths, |path| example::check(path, &folder))
        .into_iter()
        .flatten()
        .collect();
    report::conclude("examples", paths.len(), 10, &failures);
}

/// Each shows one mistake, in the line that says so.
#[test]
fn mistakes_in_examples_are_reported_at_their_place() {
    bbz::path();
    let paths = files::with_extension("examples/errors", "bzz");
    let failures: Vec<_> = files::in_parallel(&paths, |path| {
        let text = files::read(path);
        let mistake = text.lines().position(|line| line.contains("<- mistake"));
        let line = 1 + mistake.unwrap_or_else(|| panic!("{path} marks no mistake"));
        let outcome = bbz::run(&["check", path], &[]);
        let found = diagnostics::parse(&outcome.stderr);
        let places: Vec<_> = found.iter().filter_map(|d| d.place.clone()).collect();
        let expected = places == [(path.clone(), line)] && outcome.status == Some(2);
        (!expected).then(|| format!("{path}:{line}: {:?}\n{}", outcome.status, outcome.stderr))
    })
    .into_iter()
    .flatten()
    .collect();
    report::conclude("examples/errors", paths.len(), 3, &failures);
}
