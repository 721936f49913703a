//! Images do on chips what they do on the host: every conformance script, and generated programs.
//!
//! `cargo xtask soak same`, or `soak floats`, builds the chips' programs and calls this, with
//! * `BITTYBUZZ_TARGET`: a target of `target.rs`, and `BITTYBUZZ_PROGRAM`: its linked program;
//! * `BITTYBUZZ_SEEDS=0..500`: the generated programs of these seeds, in place of the conformance scripts; the blocks of pairs for the
//!   sweep over floats.

mod elf;
mod emulator;
mod exceptions;
mod floats;
mod programs;
mod target;

use bittybuzz_on_chip::{End, Header, Report};
use bittybuzz_tests::{files, report};
use bittybuzz_vm_core::FaultCode;
use elf::Linked;
use programs::Program;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use target::Target;

/// Begins the line that `xtask` keeps.
const SUMMARY: &str = "compared: ";

#[test]
#[ignore = "needs the chips' programs: `cargo xtask soak same`"]
fn a_chip_does_what_the_host_does() {
    let target = Target::find(&variable("BITTYBUZZ_TARGET"));
    let path = PathBuf::from(variable("BITTYBUZZ_PROGRAM"));
    let chip = Linked::new(std::fs::read(&path).expect("the chip's program can be read"));
    let (programs, mut failures) = match std::env::var("BITTYBUZZ_SEEDS") {
        Ok(seeds) => split(programs::generated(target.full, range(&seeds))),
        Err(_) => exceptions::conformance(&target),
    };
    let (programs, too_long): (Vec<Program>, Vec<Program>) =
        programs.into_iter().partition(|program| program.size() + Header::LENGTH <= chip.room());
    let batches = batches(programs, chip.room());
    let folder =
        tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).expect("the build folder is writable");
    let run = |(number, programs): &(usize, Vec<Program>)| {
        let file = folder.path().join(number.to_string());
        compare(&target, &chip, programs, &file)
    };
    let results = files::in_parallel(&batches, run);
    let mut endings: BTreeMap<String, u32> = BTreeMap::new();
    let mut slices = 0_u64;
    for result in results.into_iter().flatten() {
        match result {
            Ok(report) => {
                *endings.entry(ending(&report)).or_default() += 1;
                slices += u64::from(report.slices);
            }
            Err(failure) => failures.push(failure),
        }
    }
    let count = endings.values().sum::<u32>() as usize + failures.len();
    if !too_long.is_empty() {
        endings.insert("too long for the chip".to_owned(), too_long.len() as u32);
    }
    let endings: Vec<String> = endings.iter().map(|(end, n)| format!("{n} {end}")).collect();
    let (endings, batches) = (endings.join(", "), batches.len());
    println!("{SUMMARY}{count} programs in {batches} batches, {slices} slices: {endings}");
    report::conclude(target.name, count, 1, &failures);
}

fn variable(name: &str) -> String {
    std::env::var(name).unwrap_or_else(|_| panic!("{name} is not set"))
}

fn range(text: &str) -> std::ops::Range<u64> {
    let numbers = text.split_once("..").and_then(|(from, to)| Some((from.parse().ok()?, to)));
    let range = numbers.and_then(|(from, to)| Some(from..to.parse().ok()?));
    range.unwrap_or_else(|| panic!("BITTYBUZZ_SEEDS=FROM..TO, not `{text}`"))
}

fn split(programs: Vec<Result<Program, String>>) -> (Vec<Program>, Vec<String>) {
    let (good, bad): (Vec<_>, Vec<_>) = programs.into_iter().partition(Result::is_ok);
    (good.into_iter().flatten().collect(), bad.into_iter().filter_map(Result::err).collect())
}

/// As many programs in each as there is room for.
fn batches(programs: Vec<Program>, room: usize) -> Vec<(usize, Vec<Program>)> {
    let mut batches = Vec::new();
    let mut batch: Vec<Program> = Vec::new();
    let mut size = Header::LENGTH;
    for program in programs {
        if size + program.size() > room {
            batches.push(std::mem::take(&mut batch));
            size = Header::LENGTH;
        }
        size += program.size();
        batch.push(program);
    }
    batches.push(batch);
    batches.into_iter().enumerate().collect()
}

/// What the host reports of each, or how the chip differs.
fn compare(
    target: &Target,
    chip: &Linked,
    programs: &[Program],
    file: &Path,
) -> Vec<Result<Report, String>> {
    let printed = run(target, chip, programs.iter().map(|program| (program.header, program)), file);
    let mut is_first = true;
    let compared = programs.iter().enumerate().map(|(number, program)| {
        let expected = target.expected(program.header, &program.image);
        let printed = printed.get(number).map(String::as_str);
        if printed == Some(line(&expected).as_str()) {
            return Ok(expected);
        }
        let name = &program.name;
        let mut failure = format!("{name}: {printed:?} instead of {expected:?}");
        // Those after it in the machine may only suffer from it.
        if std::mem::take(&mut is_first) {
            let budget = program.header.budget;
            failure += &match first_difference(target, chip, program, expected.slices, file) {
                Some(slices) => format!("; alone it differs after {slices} slices of {budget}"),
                None => "; alone it does the same".to_owned(),
            };
        }
        Err(failure + "\n")
    });
    compared.collect()
}

/// What the chip tells of each.
fn run<'p>(
    target: &Target,
    chip: &Linked,
    programs: impl Iterator<Item = (Header, &'p Program)>,
    file: &Path,
) -> Vec<String> {
    let mut batch = Vec::new();
    let mut count = 0;
    for (header, program) in programs {
        batch.extend(header.to_bytes());
        batch.extend(&program.image);
        count += 1;
    }
    batch.extend([0; Header::LENGTH]);
    target.emulator.run(&chip.with(&batch), file, count)
}

/// The smallest number of slices after which the traces differ, if the program runs alone.
fn first_difference(
    target: &Target,
    chip: &Linked,
    program: &Program,
    all: u32,
    file: &Path,
) -> Option<u32> {
    let differs = |slices| {
        let header = Header { slices, ..program.header };
        let printed = run(target, chip, [(header, program)].into_iter(), file);
        printed != [line(&target.expected(header, &program.image))]
    };
    let (mut same, mut different) = (0, all + 1);
    if !differs(different) {
        return None;
    }
    while different - same > 1 {
        let slices = same + (different - same) / 2;
        *if differs(slices) { &mut different } else { &mut same } = slices;
    }
    Some(different)
}

/// Without the newline.
fn line(report: &Report) -> String {
    String::from_utf8_lossy(&report.line()).trim_end().to_owned()
}

fn ending(report: &Report) -> String {
    match report.end {
        End::Fault(fault) => match fault.code {
            FaultCode::OutOfMemory | FaultCode::StackOverflow => "no memory".to_owned(),
            _ => "fault".to_owned(),
        },
        End::Refused(_) => "refused".to_owned(),
        End::Complete => "complete".to_owned(),
        End::GivenUp => "given up".to_owned(),
    }
}
