//! All scripts of the suites in every way that must make no difference, and with allocations that fail.
//!
//! `BITTYBUZZ_TORTURE=all` makes every allocation fail instead of a sample, and does not leave out the slowest scripts.

use std::collections::BTreeMap;

use bittybuzz_tests::machine::End;
use bittybuzz_tests::{compiler, files, report, torture};
use bittybuzz_vm_core::Vm;
use bittybuzz_vm_core::number::{Full, Profile, Tiny};

/// Slots of a machine that only scripts about memory fill.
const SLOTS: usize = 20_000;
/// How far a test goes.
#[derive(Clone, Copy)]
struct Extent {
    /// Instructions after which a script is given up: some are about endless loops.
    most_instructions: u64,
    /// The most allocations that are made to fail, one by one, for each script.
    failures: u32,
}

const SAMPLE: Extent = Extent { most_instructions: 200_000, failures: 20 };
/// Every allocation of all but some scripts that make garbage for a long time.
const ALL: Extent = Extent { most_instructions: 2_000_000, failures: 2000 };

#[test]
fn torture_does_not_change_results() {
    let extent = match std::env::var("BITTYBUZZ_TORTURE").as_deref() {
        Ok("all") => ALL,
        Ok(other) => panic!("BITTYBUZZ_TORTURE=all, not `{other}`"),
        Err(_) => SAMPLE,
    };
    let folders = ["tests/bzz", "tests/conformance", "examples"];
    let paths = folders.iter().flat_map(|folder| files::with_extension(folder, "bzz"));
    let runs: Vec<(String, bool)> =
        paths.flat_map(|path| [(path.clone(), false), (path, true)]).collect();
    let results = files::in_parallel(&runs, |(path, full)| {
        let result = if *full { run::<Full>(path, extent) } else { run::<Tiny>(path, extent) };
        result.map_err(|problem| format!("{path}:1: {problem}"))
    });
    let mut endings: BTreeMap<String, usize> = BTreeMap::new();
    let mut failures = Vec::new();
    for result in results {
        match result {
            Ok(ending) => *endings.entry(ending).or_default() += 1,
            Err(failure) => failures.push(failure),
        }
    }
    println!("endings: {endings:?}");
    let of = |ending: &str| endings.get(ending).copied().unwrap_or(0);
    assert!(of("GivenUp") <= 4, "too many scripts are given up");
    let complete = of("Complete");
    report::conclude("torture", complete + failures.len(), 900, &failures);
}

/// How a script ends, or what is wrong.
fn run<P: Profile>(path: &str, extent: Extent) -> Result<String, String> {
    // Some scripts are about mistakes, or about the other profile.
    let Some(image) = compiler::compile_file(path, P::FULL).image else {
        return Ok("does not compile".to_owned());
    };
    let mut vm: Box<Vm<P, &[u8], SLOTS>> = Box::new(Vm::new());
    let trace = torture::in_every_way(&mut vm, &image, extent.most_instructions, extent.failures)
        .map_err(|problem| format!("{}: {problem}", P::NAME))?;
    Ok(match trace.end {
        End::Fault(fault) => format!("{:?}", fault.code),
        End::Refused(error) => format!("{error:?}"),
        end => format!("{end:?}"),
    })
}
