//! Functions and operators with arguments of every type, beside Buzz: `compatibility/arguments.txt` has what each script
//! did there. Each difference is one of a `[[family]]` of `compatibility/differences.toml`.
//!
//! To record again, after the scripts have changed:
//! `BUZZ_BIN=FOLDER cargo test --locked -p bittybuzz-tests --test tests -- --ignored buzz_records_arguments`

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use bittybuzz_tests::arguments::{self, Subject};
use bittybuzz_tests::buzz::Buzz;
use bittybuzz_tests::compatibility::{self, End};
use bittybuzz_tests::{bbz, files, here, report};
use bittybuzz_vm_core::hash::fnv_1a;

const RECORD: &str = "tests/compatibility/arguments.txt";

/// The word that the record has for the end of a script: a hash of what it prints, else the kind of the end.
fn word(end: &End) -> String {
    match end {
        End::Prints(output) => format!("{:04x}", fnv_1a(output.as_bytes()) as u16),
        End::Stops(_) => "stop".to_owned(),
        End::Refuses(_) => "deny".to_owned(),
        End::Crashes => "trap".to_owned(),
    }
}

#[test]
fn arguments_of_every_type_do_what_was_recorded_from_buzz() {
    let families = compatibility::load("tests/compatibility/differences.toml").families;
    let page = files::read("COMPATIBILITY.md");
    let rows = compatibility::points(&page);
    for family in &families {
        let is_stated = rows.contains(&family.point) || page.contains(&family.point);
        assert!(is_stated, "COMPATIBILITY.md does not state: {}", family.point);
    }
    let text = files::read(RECORD);
    let lines: Vec<&str> = text.lines().filter(|line| !line.starts_with('#')).collect();
    let subjects = arguments::subjects();
    assert_eq!(
        lines.len(),
        subjects.len(),
        "{RECORD}: a line for each function, operator and statement"
    );
    let pairs: Vec<(Subject, &str)> = subjects.into_iter().zip(lines).collect();
    let results = files::in_parallel(&pairs, |(Subject { name, scripts }, line)| {
        let (recorded, words) = line.split_once('\t').unwrap_or_default();
        let words: Vec<&str> = words.split(' ').collect();
        assert_eq!((recorded, words.len()), (*name, scripts.len()), "{RECORD}: record again");
        let (mut failures, mut used) = (Vec::new(), BTreeSet::new());
        for (script, recorded) in scripts.iter().zip(words) {
            let (_, end) = here::run(script);
            // A crash of Buzz is no behavior that a script could want.
            if word(&end) == recorded || recorded == "trap" {
                continue;
            }
            match families.iter().position(|family| family.explains(name, &end)) {
                Some(family) => _ = used.insert(family),
                None => {
                    failures.push(format!("{name}: {end} here, with Buzz {recorded}\n{script}"))
                }
            }
        }
        (failures, used, scripts.len())
    });
    let count = results.iter().map(|(_, _, count)| count).sum();
    let used: BTreeSet<usize> = results.iter().flat_map(|(_, used, _)| used).copied().collect();
    let mut failures: Vec<_> = results.into_iter().flat_map(|(failures, ..)| failures).collect();
    for (number, family) in families.iter().enumerate().filter(|(it, _)| !used.contains(it)) {
        failures.push(format!("family {number} explains nothing: {family:?}"));
    }
    report::conclude("arguments of every type", count, 7000, &failures);
}

#[test]
#[ignore = "needs `bzzc` and `bzzrun` of Buzz in the folder BUZZ_BIN, and writes what they do"]
fn buzz_records_arguments() {
    let numbered: Vec<_> = arguments::subjects().into_iter().enumerate().collect();
    let lines = files::in_parallel(&numbered, |(number, Subject { name, scripts })| {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("arguments{number}"));
        fs::create_dir_all(&folder).unwrap();
        let buzz = Buzz::new(folder.clone());
        let words: Vec<String> = scripts.iter().map(|script| word(&buzz.run(script).1)).collect();
        fs::remove_dir_all(&folder).unwrap();
        format!("{name}\t{}\n", words.join(" "))
    });
    let head = "\
# Functions and operators with arguments of every type, and what they do with Buzz 49ea418.
# Written by tests/tests/arguments.rs: the hash of what each script prints, or `stop`, `deny` (by the compiler), `trap`.
";
    fs::write(bbz::root().join(RECORD), format!("{head}{}", lines.concat())).unwrap();
}
