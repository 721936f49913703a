//! What the shipped scenarios expect comes true.

use bittybuzz_tests::{bbz, files, report};

#[test]
fn shipped_scenarios_come_true() {
    bbz::path();
    let mut paths = files::with_extension("examples", "toml");
    // Those need images of robots: tests/hil/tests/unlike.rs.
    paths.retain(|path| !path.starts_with("examples/unlike/"));
    let failures: Vec<_> = files::in_parallel(&paths, |path| {
        let outcome = bbz::run(&["sim", path, "--headless"], &[]);
        let came_true = outcome.status == Some(0) && outcome.stderr.is_empty();
        (!came_true)
            .then(|| format!("{path}: {:?}\n{}{}", outcome.status, outcome.stdout, outcome.stderr))
    })
    .into_iter()
    .flatten()
    .collect();
    report::conclude("scenarios", paths.len(), 14, &failures);
}

/// `cargo xtask soak day` runs all 24 hours.
#[test]
fn the_first_minutes_of_the_day() {
    bbz::path();
    let arguments =
        ["sim", "tests/scenarios/day.toml", "--headless", "--set", "world.duration=600"];
    let outcome = bbz::run(&arguments, &[]);
    assert_eq!(outcome.status, Some(0), "{}{}", outcome.stdout, outcome.stderr);
}
