//! Random programs do the same however they are run: in small slices, with collections all the time, with hardly any
//! memory; and when an allocation fails they stop cleanly.
//!
//! `BITTYBUZZ_SEEDS=1000..2000` runs those seeds instead of the sample.

use std::collections::BTreeMap;
use std::ops::Range;

use bittybuzz_compiler::diagnostic::Severity;
use bittybuzz_compiler::include::MemoryFiles;
use bittybuzz_tests::generator::{self, Options};
use bittybuzz_tests::machine::{self, End, Settings, Trace};
use bittybuzz_tests::{compiler, files, report, torture};
use bittybuzz_vm_core::number::{Full, Profile, Tiny};
use bittybuzz_vm_core::{Torture, Vm};

/// The seeds of an ordinary run.
const SAMPLE: Range<u64> = 0..100;
/// Slots of a machine that no random program fills.
const SLOTS: usize = 60_000;
/// The most allocations that are made to fail, one by one, for each program.
const FAILURES: u32 = 200;
/// What one program may take; the generator keeps far below.
const INSTRUCTIONS_MAX: u64 = 1_000_000;

#[test]
fn random_programs_are_deterministic() {
    let seeds = match std::env::var("BITTYBUZZ_SEEDS") {
        Ok(range) => parse(&range),
        Err(_) => SAMPLE,
    };
    let runs: Vec<(u64, bool)> =
        seeds.clone().flat_map(|seed| [(seed, false), (seed, true)]).collect();
    let results =
        files::in_parallel(
            &runs,
            |(seed, full)| {
                if *full { check::<Full>(*seed) } else { check::<Tiny>(*seed) }
            },
        );
    let mut endings: BTreeMap<String, u32> = BTreeMap::new();
    let mut failures = Vec::new();
    for result in results {
        match result {
            Ok(ending) => *endings.entry(ending).or_default() += 1,
            Err(failure) => failures.push(failure),
        }
    }
    println!("endings: {endings:?}");
    let given_up = endings.get("GivenUp").copied().unwrap_or(0) as usize;
    assert!(given_up * 50 <= runs.len(), "{given_up} programs of {} take too long", runs.len());
    report::conclude("random programs", runs.len(), seeds.count(), &failures);
}

fn parse(range: &str) -> Range<u64> {
    let numbers = range
        .split_once("..")
        .and_then(|(from, to)| Some(from.trim().parse().ok()?..to.trim().parse().ok()?));
    numbers.unwrap_or_else(|| panic!("BITTYBUZZ_SEEDS=FROM..TO, not `{range}`"))
}

/// How the program ends, or what is wrong.
fn check<P: Profile>(seed: u64) -> Result<String, String> {
    let options = Options { seed, full: P::FULL, hide_literals: false };
    let program = generator::program(options);
    check_program::<P>(&program, options)
        .map_err(|problem| format!("seed {seed}, {}:1: {problem}\n{program}", P::NAME))
}

fn check_program<P: Profile>(program: &str, options: Options) -> Result<String, String> {
    let image = built::<P>(program)?;
    let hidden = built::<P>(&generator::program(Options { hide_literals: true, ..options }))?;
    let mut vm: Box<Vm<P, &[u8], SLOTS>> = Box::new(Vm::new());
    let trace = torture::in_every_way(&mut vm, &image, INSTRUCTIONS_MAX, FAILURES)?;
    match trace.end {
        End::GivenUp => return Ok("GivenUp".to_owned()),
        End::Refused(error) => return Err(format!("the compiler's image is refused: {error:?}")),
        End::Fault(fault) if torture::is_memory(fault.code) => {
            return Err(format!("{fault:?} with all memory there is"));
        }
        End::Complete | End::Fault(_) => {}
    }
    let settings = Settings {
        slots: SLOTS,
        budget: u16::MAX,
        torture: Torture::default(),
        audit: false,
        most: INSTRUCTIONS_MAX,
    };
    same_but_positions(&trace, &machine::run(&mut vm, &hidden, &settings))
        .map_err(|problem| format!("literals in variables: {problem}"))?;
    Ok(match trace.end {
        End::Fault(fault) => format!("{:?}", fault.code),
        end => format!("{end:?}"),
    })
}

fn built<P: Profile>(program: &str) -> Result<Vec<u8>, String> {
    let compiled = compiler::compile(program.to_owned(), P::FULL, &MemoryFiles::default());
    compiled.image.ok_or_else(|| {
        let errors: Vec<String> = compiled
            .diagnostics
            .iter()
            .filter(|diagnostic| diagnostic.severity() == Severity::Error)
            .map(|diagnostic| format!("{diagnostic:?}"))
            .collect();
        format!("does not compile: {}", errors.join("\n"))
    })
}

/// The same program with other code.
fn same_but_positions(expected: &Trace, trace: &Trace) -> Result<(), String> {
    let ends = match (expected.end, trace.end) {
        (End::Fault(a), End::Fault(b)) => a.code == b.code,
        (a, b) => a == b,
    };
    if ends && trace.output == expected.output { Ok(()) } else { torture::same(expected, trace) }
}
