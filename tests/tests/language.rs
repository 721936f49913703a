//! The scripts of `bzz/`: every rule of the language, one script each.

use bittybuzz_tests::script::Script;
use bittybuzz_tests::{bbz, files, report};

/// Scripts about neighbors, swarms and stigmergy.
const SWARM: &str = "tests/bzz/swarm/";

fn run(subject: &str, paths: &[String], at_least: usize) {
    bbz::path();
    let results = files::in_parallel(paths, |path| match Script::load(path) {
        Ok(script) => script.run(),
        Err(failure) => (0, vec![failure]),
    });
    let runs = results.iter().map(|(runs, _)| runs).sum();
    let failures: Vec<_> = results.into_iter().flat_map(|(_, failures)| failures).collect();
    report::conclude(subject, runs, at_least, &failures);
}

#[test]
fn scripts_meet_the_expectations_in_their_comments() {
    let mut paths = files::with_extension("tests/bzz", "bzz");
    paths.retain(|path| !path.starts_with(SWARM));
    run("language", &paths, 1200);
}

#[test]
fn swarm_scripts_meet_the_expectations_in_their_comments() {
    run("swarm", &files::with_extension(SWARM, "bzz"), 5);
}
