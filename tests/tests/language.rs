//! The scripts of `bzz/`: every rule of the language, one script each.

use bittybuzz_tests::script::Script;
use bittybuzz_tests::{bbz, files, report};

#[test]
fn scripts_do_what_their_comments_say() {
    bbz::path();
    let paths = files::with_extension("tests/bzz", "bzz");
    let results = files::in_parallel(&paths, |path| match Script::load(path) {
        Ok(script) => script.run(),
        Err(failure) => (0, vec![failure]),
    });
    let runs = results.iter().map(|(runs, _)| runs).sum();
    let failures: Vec<_> = results.into_iter().flat_map(|(_, failures)| failures).collect();
    report::conclude("language", runs, 400, &failures);
}
