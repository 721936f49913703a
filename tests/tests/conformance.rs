//! The scripts of `conformance/`, with the results of the reference Buzz machine.

use bittybuzz_tests::{bbz, conformance, files, report};

/// Neighbours, swarms and stigmergy: scripts for the robots' side of the language.
const SWARM_SCRIPTS: [&str; 3] = ["nbr_", "swarm_", "vstig_"];

#[test]
fn scripts_print_what_the_reference_prints() {
    bbz::path();
    let mut paths = files::with_extension("tests/conformance", "bzz");
    paths.retain(|path| {
        let name = path.rsplit('/').next().unwrap_or(path);
        !SWARM_SCRIPTS.iter().any(|prefix| name.starts_with(prefix))
    });
    let failures: Vec<_> = files::in_parallel(&paths, |path| conformance::run(path, &[]))
        .into_iter()
        .flatten()
        .collect();
    report::conclude("conformance", paths.len(), 44, &failures);
}
