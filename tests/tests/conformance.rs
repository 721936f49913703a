//! The scripts of `conformance/`, with the results of the reference Buzz machine.

use bittybuzz_tests::{bbz, conformance, files, report};

/// Neighbors, swarms and stigmergy: scripts for the robots' side of the language.
const SWARM: [&str; 3] = ["nbr_", "swarm_", "vstig_"];

/// What the robot of the swarm scripts sees: id, distance, azimuth and elevation.
const NEIGHBORS: [&str; 6] =
    ["--neighbor", "2,10,0.5,0", "--neighbor", "3,20,1,0.25", "--neighbor", "4,30,-0.5,0"];

fn run(subject: &str, is_swarm: bool, arguments: &[&str], at_least: usize) {
    bbz::path();
    let mut paths = files::with_extension("tests/conformance", "bzz");
    paths.retain(|path| {
        let name = path.rsplit('/').next().unwrap_or(path);
        SWARM.iter().any(|prefix| name.starts_with(prefix)) == is_swarm
    });
    let failures: Vec<_> = files::in_parallel(&paths, |path| conformance::run(path, arguments))
        .into_iter()
        .flatten()
        .collect();
    report::conclude(subject, paths.len(), at_least, &failures);
}

#[test]
fn scripts_print_the_output_of_the_reference() {
    run("conformance", false, &[], 44);
}

#[test]
fn swarm_scripts_print_the_output_of_the_reference() {
    run("conformance of swarms", true, &NEIGHBORS, 4);
}
