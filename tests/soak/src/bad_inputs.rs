//! Bad inputs for `bbz`: the kinds of `tests/bad-inputs`.

use anyhow::Result;

use crate::Verdict;

/// Path prefixes of the files that the inputs are about.
pub const MADE_OF: &[&str] = &[
    "Cargo",
    "arena/src/",
    "bbz/page/src/",
    "bbz/src/",
    "comms/src/",
    "comms/trace-reader/",
    "compiler/src/",
    "fuzz/corpus/",
    "inspect/",
    "lib/",
    "live/src/",
    "robots/",
    "spec/",
    "tests/bad-inputs/",
    "tests/soak/src/bad_inputs.rs",
    "vm-core/src/",
];

/// Names of all kinds.
pub fn items() -> Vec<String> {
    bittybuzz_bad_inputs::kinds().iter().map(|kind| kind.name.to_owned()).collect()
}

/// Runs all inputs of a kind.
#[cfg(unix)]
pub fn run(name: &str) -> Result<Verdict> {
    use bittybuzz_bad_inputs::{PER_KIND, Runner, kinds};
    use bittybuzz_builds::cargo_test;
    use bittybuzz_builds::shell::{root, target};

    let Some(kind) = kinds().into_iter().find(|kind| kind.name == name) else {
        return Ok(Verdict::Missing("there is no such kind".to_owned()));
    };
    let kept = target()?.join("soak/bad_inputs");
    let runner = Runner::new(&cargo_test::bbz()?, root(), &kept)?;
    let mut broken = Vec::new();
    for seed in 0..PER_KIND {
        if let Some(found) = runner.run(&kind, seed)? {
            let (rules, folder) = (found.rules.join(", "), found.kept.display());
            println!("{name} {seed}: {rules}; its input is in {folder}");
            broken.push(format!("{seed}: {rules}"));
        }
    }
    Ok(match broken.is_empty() {
        true => Verdict::Shown(format!("{PER_KIND} inputs without a broken rule")),
        false => Verdict::Missing(broken.join("; ")),
    })
}

/// The limits of processes and the special files are those of Unix.
#[cfg(not(unix))]
pub fn run(_: &str) -> Result<Verdict> {
    Ok(Verdict::Missing("it needs Unix".to_owned()))
}
