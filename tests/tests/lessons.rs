//! Each assignment of examples/lessons can be solved, and is not solved yet when learners get it.

use bittybuzz_tests::{bbz, files, report};

/// A solution must not depend on chance.
const SEEDS: [&str; 3] = ["1", "2", "3"];

#[test]
fn assignments_are_unsolved_and_can_be_solved() {
    bbz::path();
    let mut paths = files::with_extension("examples/lessons", "toml");
    // The others are robot files.
    paths.retain(|path| files::read(path).contains("\n[assignment]\n"));
    let failures: Vec<_> =
        files::in_parallel(&paths, |path| check(path)).into_iter().flatten().collect();
    report::conclude("assignments", paths.len(), 10, &failures);
}

fn check(path: &str) -> Vec<String> {
    let mut failures = Vec::new();
    for seed in SEEDS {
        let start = simulate(path, seed, &[]);
        // An expectation fails, and nothing else.
        if start.status != Some(1) || !start.stderr.is_empty() {
            failures
                .push(format!("{path}, seed {seed}, start: {:?}\n{}", start.status, start.stderr));
        }
        let solution = simulate(path, seed, &solved(path));
        if solution.status != Some(0) || !solution.stderr.is_empty() {
            let printed = solution.stdout + &solution.stderr;
            failures.push(format!("{path}, seed {seed}, solution: {printed}"));
        }
    }
    failures
}

/// Options that give every group the solution.
fn solved(path: &str) -> Vec<String> {
    let name = path.trim_start_matches("examples/lessons/").trim_end_matches(".toml");
    let groups = files::read(path).matches("\n[[robots]]\n").count();
    let values = (0..groups).map(|group| format!("robots.{group}.script=solutions/{name}.bzz"));
    values.flat_map(|value| ["--set".to_owned(), value]).collect()
}

fn simulate(path: &str, seed: &str, options: &[String]) -> bbz::Outcome {
    let mut arguments = vec!["sim", path, "--headless", "--seed", seed];
    arguments.extend(options.iter().map(String::as_str));
    bbz::run(&arguments, &[])
}
