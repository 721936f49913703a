//! Input that must be refused, with the right message and exit status, and never with a panic.

use std::fs;
use std::path::Path;

use bittybuzz_tests::{bbz, files, malformed, report};

#[test]
fn bad_input_is_refused() {
    bbz::path();
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("malformed");
    fs::create_dir_all(&folder).unwrap();
    let cases: Vec<_> =
        malformed::load("tests/malformed/manifest.toml").into_iter().enumerate().collect();
    let failures: Vec<_> =
        files::in_parallel(&cases, |(number, case)| malformed::run(case, *number, &folder))
            .into_iter()
            .flatten()
            .collect();
    report::conclude("malformed", cases.len(), 40, &failures);
}
