//! COMPATIBILITY.md beside Buzz: each row of its tables has scripts whose results were recorded on both.

use std::fs;
use std::path::{Path, PathBuf};

use bittybuzz_tests::buzz::Buzz;
use bittybuzz_tests::compatibility::{self, Case, Differences, End};
use bittybuzz_tests::{bbz, files, report};

fn differences() -> Differences {
    compatibility::load("tests/compatibility/differences.toml")
}

/// A folder for the scripts of one test.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    fs::create_dir_all(&folder).unwrap();
    folder
}

fn failure(case: &Case, what: &str, expected: &End, actual: &End) -> Option<String> {
    (expected != actual).then(|| {
        format!("{}: {what} {actual}, not {expected}\n{}\n", case.point, case.script.trim_end())
    })
}

#[test]
fn each_row_has_a_script_or_a_reason() {
    let recorded = differences();
    let rows = compatibility::points(&files::read("COMPATIBILITY.md"));
    assert!(rows.len() >= 30, "the tables have only {} rows", rows.len());
    let mut backed: Vec<&String> = recorded.no_case.iter().collect();
    backed.extend(recorded.cases.iter().map(|case| &case.point));
    let missing: Vec<_> = rows.iter().filter(|row| !backed.contains(row)).collect();
    assert!(missing.is_empty(), "rows without a script: {missing:#?}");
    let unknown: Vec<_> = backed.iter().filter(|point| !rows.contains(point)).collect();
    assert!(unknown.is_empty(), "points that no row has: {unknown:#?}");
}

#[test]
fn each_script_shows_a_difference() {
    for case in differences().cases {
        let like = case.buzz.is_like(&case.here);
        assert_eq!(like, case.as_buzz, "{}\n{}", case.point, case.script);
    }
}

#[test]
fn results_here_are_those_recorded() {
    bbz::path();
    let folder = folder("compatibility");
    let cases: Vec<_> = differences().cases.into_iter().enumerate().collect();
    let failures: Vec<_> = files::in_parallel(&cases, |(number, case)| {
        let path = folder.join(format!("{number}.bzz"));
        fs::write(&path, &case.script).unwrap();
        let path = path.to_string_lossy();
        let end = End::of_bbz(&bbz::run(&["run", path.as_ref(), "--steps", "0"], &[]));
        failure(case, "BittyBuzz in Rust", &case.here, &end)
    })
    .into_iter()
    .flatten()
    .collect();
    report::conclude("differences", cases.len(), 35, &failures);
}

#[test]
#[ignore = "needs `bzzc` and `bzzrun` of Buzz in the folder BUZZ_BIN"]
fn buzz_still_does_what_was_recorded() {
    let buzz = Buzz::new(folder("buzz"));
    let cases = differences().cases;
    let failures: Vec<_> = cases
        .iter()
        .filter_map(|case| failure(case, "Buzz", &case.buzz, &buzz.run(&case.script).1))
        .collect();
    report::conclude("results of Buzz", cases.len(), 35, &failures);
}
