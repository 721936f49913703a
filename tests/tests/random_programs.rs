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
use bittybuzz_tests::{compiler, files, report};
use bittybuzz_vm_core::number::{Full, Profile, Tiny};
use bittybuzz_vm_core::{FaultCode, ImageError, Torture, Vm};

/// The seeds of an ordinary run.
const SAMPLE: Range<u64> = 0..300;
/// Slots of a machine that no random program fills.
const SLOTS: usize = 60_000;
/// The most allocations that are made to fail, one by one, for each program.
const FAILURES: u32 = 200;
/// What one program may take; the generator keeps far below.
const MOST_INSTRUCTIONS: u64 = 1_000_000;

const UNLIMITED: Settings = Settings {
    slots: SLOTS,
    budget: u16::MAX,
    torture: Torture { collect_always: false, fail_at: None, allocations: 0 },
    audit: false,
    most: MOST_INSTRUCTIONS,
};

#[test]
fn random_programs_always_do_the_same() {
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
    let mut vm: Box<Vm<P, &[u8], SLOTS>> = Box::new(Vm::new(3));
    let expected = machine::run(&mut vm, &image, &UNLIMITED);
    match expected.end {
        End::GivenUp => return Ok("GivenUp".to_owned()),
        End::Refused(error) => return Err(format!("the compiler's image is refused: {error:?}")),
        End::Fault(fault) if is_memory(fault.code) => {
            return Err(format!("{fault:?} with all memory there is"));
        }
        End::Complete | End::Fault(_) => {}
    }
    let allocations = vm.torture.allocations;

    let slices =
        [1, 7].map(|budget| (format!("budget {budget}"), Settings { budget, ..UNLIMITED }));
    let collecting = Torture { collect_always: true, ..Torture::default() };
    let others = [
        ("memory looked at", Settings { budget: 61, audit: true, ..UNLIMITED }),
        ("a collection at every allocation", Settings { torture: collecting, ..UNLIMITED }),
        ("both", Settings { torture: collecting, budget: 61, audit: true, ..UNLIMITED }),
    ]
    .map(|(name, settings)| (name.to_owned(), settings));
    for (name, settings) in slices.into_iter().chain(others) {
        let trace = machine::run(&mut vm, &image, &settings);
        same(&expected, &trace).map_err(|problem| format!("{name}: {problem}"))?;
    }
    let trace = machine::run(&mut vm, &hidden, &UNLIMITED);
    same_but_positions(&expected, &trace)
        .map_err(|problem| format!("literals in variables: {problem}"))?;

    let enough = little_memory(&mut vm, &image, &expected)?;
    let settings = Settings { slots: enough, ..UNLIMITED };
    failing_allocations(&mut vm, &image, &expected, &settings, allocations)?;
    Ok(match expected.end {
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

/// The smallest memory that works, and what happens with less.
fn little_memory<'i, P: Profile>(
    vm: &mut Vm<P, &'i [u8], SLOTS>,
    image: &'i [u8],
    expected: &Trace,
) -> Result<usize, String> {
    let (mut too_few, mut enough) = (0, SLOTS);
    while enough - too_few > 1 {
        // Few programs need much.
        let slots = (too_few + enough) / 2;
        let slots = slots.min(2 * too_few + 64);
        let settings = Settings { slots, ..UNLIMITED };
        let trace = machine::run(vm, image, &settings);
        if trace == *expected {
            enough = slots;
        } else {
            out_of_memory(expected, &trace)
                .map_err(|problem| format!("{slots} slots: {problem}"))?;
            too_few = slots;
        }
    }
    for (budget, audit) in [(u16::MAX, false), (1, false), (7, true)] {
        let settings = Settings { slots: enough, budget, audit, ..UNLIMITED };
        let trace = machine::run(vm, image, &settings);
        if audit {
            // Looking at memory collects, so that it is used in another way.
            out_of_memory(expected, &trace).or_else(|_| same(expected, &trace))
        } else {
            same(expected, &trace)
        }
        .map_err(|problem| format!("{enough} slots, budget {budget}: {problem}"))?;
    }
    // A little more need not be enough, as garbage then lies in other places; twice as much is.
    let settings = Settings { slots: (2 * enough + 64).min(SLOTS), ..UNLIMITED };
    let trace = machine::run(vm, image, &settings);
    same(expected, &trace).map_err(|problem| format!("twice {enough} slots: {problem}"))?;
    Ok(enough)
}

/// Every allocation fails once.
fn failing_allocations<'i, P: Profile>(
    vm: &mut Vm<P, &'i [u8], SLOTS>,
    image: &'i [u8],
    expected: &Trace,
    settings: &Settings,
    allocations: u32,
) -> Result<(), String> {
    for number in 0..allocations.min(FAILURES) {
        let fail_at = if allocations <= FAILURES {
            number
        } else {
            (u64::from(number) * u64::from(allocations) / u64::from(FAILURES)) as u32
        };
        let torture = Torture { fail_at: Some(fail_at), ..Torture::default() };
        let trace = machine::run(vm, image, &Settings { torture, ..*settings });
        let ended = match trace.end {
            End::Fault(fault) if fault.code == FaultCode::OutOfMemory => {
                out_of_memory(expected, &trace)
            }
            end => Err(format!("ends with {end:?}")),
        };
        ended.map_err(|problem| format!("allocation {fail_at} fails: {problem}"))?;
        if number % 16 == 0 {
            let again = machine::run(vm, image, settings);
            same(expected, &again)
                .map_err(|problem| format!("after allocation {fail_at} failed: {problem}"))?;
        }
    }
    Ok(())
}

fn is_memory(code: FaultCode) -> bool {
    matches!(code, FaultCode::OutOfMemory | FaultCode::StackOverflow)
}

/// A clean end for want of memory, after nothing but what is expected.
fn out_of_memory(expected: &Trace, trace: &Trace) -> Result<(), String> {
    match trace.end {
        End::Fault(fault) if is_memory(fault.code) => {}
        End::Refused(ImageError::TooManyGlobals(_) | ImageError::TooManyJumps(_)) => {}
        end => return Err(format!("ends with {end:?}{}", difference(expected, trace))),
    }
    if expected.output.starts_with(&trace.output) {
        Ok(())
    } else {
        Err(format!("other output before the fault{}", difference(expected, trace)))
    }
}

fn same(expected: &Trace, trace: &Trace) -> Result<(), String> {
    if trace == expected {
        return Ok(());
    }
    let ends = format!("{:?} instead of {:?}", trace.end, expected.end);
    let globals = if trace.globals == expected.globals { "" } else { ", other globals" };
    Err(format!("{ends}{globals}{}", difference(expected, trace)))
}

/// The same program with other code.
fn same_but_positions(expected: &Trace, trace: &Trace) -> Result<(), String> {
    let ends = match (expected.end, trace.end) {
        (End::Fault(a), End::Fault(b)) => a.code == b.code,
        (a, b) => a == b,
    };
    if ends && trace.output == expected.output { Ok(()) } else { same(expected, trace) }
}

fn difference(expected: &Trace, trace: &Trace) -> String {
    let pairs = expected.output.lines().zip(trace.output.lines());
    let Some((number, (a, b))) = pairs.enumerate().find(|(_, (a, b))| a != b) else {
        let (a, b) = (expected.output.lines().count(), trace.output.lines().count());
        return format!("; {b} lines of output instead of {a}");
    };
    format!("; line {}: `{b}` instead of `{a}`", number + 1)
}
