//! What the shipped scenarios expect comes true.

use bittybuzz_tests::{bbz, files, report};

#[test]
fn shipped_scenarios_reach_their_expected_states() {
    bbz::path();
    let mut paths = files::with_extension("examples", "toml");
    // Those need images of robots: tests/hil/tests/mixed_swarm.rs.
    paths.retain(|path| !path.starts_with("examples/unlike/"));
    // Those of assignments come true when somebody has done them: bbz/tests/grade.rs.
    paths.retain(|path| !path.starts_with("examples/lessons/"));
    // The others are robot files.
    paths.retain(|path| files::read(path).contains("\n[world]\n"));
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

/// One robot puts a text where the others expect a number: none is silent or stopped for good.
#[test]
fn a_poisoned_entry_stops_no_robot_permanently() {
    bbz::path();
    let outcome = bbz::run(&["sim", "tests/scenarios/worm.toml"], &[]);
    assert_eq!(outcome.status, Some(0), "{}{}", outcome.stdout, outcome.stderr);
    assert_eq!(outcome.stderr.matches("error[").count(), 1, "{}", outcome.stderr);
    let note = "to start again after 1 s, and 28 others; ";
    assert!(outcome.stderr.contains(note), "{}", outcome.stderr);
    // `    12.3     7  step`: the seconds at which each robot began a step.
    let mut steps = vec![Vec::new(); 30];
    for line in outcome.stdout.lines().filter(|line| line.ends_with("  step")) {
        let mut words = line.split_whitespace();
        let time: f64 = words.next().unwrap().parse().unwrap();
        let robot: usize = words.next().unwrap().parse().unwrap();
        steps[robot].push(time);
    }
    for (robot, times) in steps.iter().enumerate() {
        let longest = times.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
        let last = times.last().copied();
        assert!(longest <= 61.0 && last > Some(369.0), "robot {robot}: {longest} s, {last:?}");
        assert_eq!(longest > 59.0, robot != 0, "robot {robot} has its longest pause: {longest} s");
    }
}

/// All kinds of adversaries, one after the other.
#[test]
fn a_swarm_survives_adversaries() {
    bbz::path();
    let outcome = bbz::run(&["sim", "tests/scenarios/adversaries.toml", "--headless"], &[]);
    assert_eq!(outcome.status, Some(0), "{}{}", outcome.stdout, outcome.stderr);
}

/// The worlds by which the speed of the simulator is measured work as they are meant to.
#[test]
fn robots_with_timing_flock_and_gather() {
    bbz::path();
    for world in ["speed-crazyflies", "speed-zooids"] {
        let path = format!("tests/scenarios/{world}.toml");
        let outcome = bbz::run(&["sim", &path, "--headless"], &[]);
        let has_errors = outcome.status != Some(0) || !outcome.stderr.is_empty();
        assert!(!has_errors, "{world}: {}{}", outcome.stdout, outcome.stderr);
    }
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
