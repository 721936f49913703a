//! Random programs beside Buzz: `compatibility/random.txt` has what each printed there, as a hash.
//!
//! To record it again, after the writer of programs has changed:
//! `BUZZ_BIN=FOLDER cargo test --locked -p bittybuzz-tests --test tests -- --ignored buzz_records`

use std::fmt::Write;
use std::fs;
use std::ops::Range;
use std::path::Path;

use bittybuzz_tests::buzz::Buzz;
use bittybuzz_tests::compatibility::End;
use bittybuzz_tests::{bbz, files, here, report, shared_language};
use bittybuzz_vm_core::hash::fnv_1a;

const RECORD: &str = "tests/compatibility/random.txt";
const PROGRAMS: u64 = 30_000;
/// Programs of an ordinary run.
const SAMPLE: usize = 3_000;
/// Programs of a line of the record.
const GROUP: u64 = 100;

/// Returns a hash of what a run printed and of its end.
fn digest(output: &str, is_complete: bool) -> u16 {
    fnv_1a(format!("{output}\n{is_complete}").as_bytes()) as u16
}

/// Returns the programs of a group, and the hash of all their text.
fn programs(seeds: Range<u64>) -> (Vec<String>, u32) {
    let programs: Vec<String> = seeds.map(shared_language::program).collect();
    let hash = fnv_1a(programs.concat().as_bytes());
    (programs, hash)
}

fn groups() -> Vec<Range<u64>> {
    (0..PROGRAMS).step_by(GROUP as usize).map(|first| first..first + GROUP).collect()
}

#[test]
fn random_programs_do_what_was_recorded_from_buzz() {
    compare(SAMPLE);
}

#[test]
#[ignore = "takes minutes: all programs of the record"]
fn every_random_program_does_what_was_recorded_from_buzz() {
    compare(PROGRAMS as usize);
}

fn compare(at_least: usize) {
    let text = files::read(RECORD);
    let lines: Vec<&str> = text.lines().filter(|line| !line.starts_with('#')).collect();
    let groups = groups();
    assert_eq!(lines.len(), groups.len(), "{RECORD}: a line for each {GROUP} programs");
    let pairs: Vec<_> = groups.into_iter().zip(lines).take(at_least / GROUP as usize).collect();
    let count = pairs.len() * GROUP as usize;
    let results = files::in_parallel(&pairs, |(seeds, line)| {
        let (programs, hash) = programs(seeds.clone());
        let mut words = line.split(' ');
        let recorded = words.next().and_then(|word| u32::from_str_radix(word, 16).ok());
        assert_eq!(
            recorded,
            Some(hash),
            "{RECORD}: the programs {seeds:?} were others: record them again"
        );
        let expected: Vec<u16> =
            words.filter_map(|word| u16::from_str_radix(word, 16).ok()).collect();
        assert_eq!(
            expected.len(),
            programs.len(),
            "{RECORD}: the results of the programs {seeds:?}"
        );
        let mut failures = Vec::new();
        let mut stopped = 0;
        for ((seed, program), expected) in seeds.clone().zip(&programs).zip(expected) {
            let (output, end) = here::run(program);
            let is_complete = matches!(end, End::Prints(_));
            stopped += usize::from(!is_complete);
            if digest(&output, is_complete) != expected {
                let text = format!("{program}\n{end} here, having printed\n{output}");
                failures.push(format!("program {seed} is another with Buzz\n{text}"));
            }
        }
        (failures, stopped)
    });
    let stopped: usize = results.iter().map(|(_, stopped)| stopped).sum();
    assert!(stopped > count / 20, "only {stopped} programs stop");
    let failures: Vec<_> = results.into_iter().flat_map(|(failures, _)| failures).collect();
    report::conclude("random programs beside Buzz", count, at_least, &failures);
}

#[test]
#[ignore = "needs `bzzc` and `bzzrun` of Buzz in the folder BUZZ_BIN, and writes what they do"]
fn buzz_records_random_programs() {
    let results = files::in_parallel(&groups(), |seeds| {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("buzz{}", seeds.start));
        fs::create_dir_all(&folder).unwrap();
        let buzz = Buzz::new(folder.clone());
        let (programs, hash) = programs(seeds.clone());
        let mut line = format!("{hash:08x}");
        for (seed, program) in seeds.clone().zip(&programs) {
            let (output, end) = buzz.run(program);
            let is_complete = match end {
                End::Prints(_) => true,
                End::Stops(_) => false,
                End::Refuses(_) | End::Crashes => panic!("program {seed}: {end}\n{program}"),
            };
            let _ = write!(line, " {:04x}", digest(&output, is_complete));
        }
        fs::remove_dir_all(&folder).unwrap();
        line + "\n"
    });
    let head = "\
# Random programs and their results with Buzz 49ea418, written by tests/tests/shared_language.rs.
# A line: the hash of 100 programs, and the hash of the output and end of each.
";
    fs::write(bbz::root().join(RECORD), format!("{head}{}", results.concat())).unwrap();
}
