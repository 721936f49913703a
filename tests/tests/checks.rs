//! `bbz run --checks` changes neither the output of a script nor the way in which it ends.

use bittybuzz_tests::{bbz, files};

fn compare(folder: &str, at_least: usize, arguments: &[&str]) {
    bbz::path();
    let paths = files::with_extension(folder, "bzz");
    let differences: Vec<String> = files::in_parallel(&paths, |path| {
        let arguments = [&["run", path.as_str(), "--steps", "3"], arguments].concat();
        let plain = bbz::run(&arguments, &[]);
        let checked = bbz::run(&[&arguments[..], &["--checks"]].concat(), &[]);
        // Messages come first, and the report after them.
        let is_same = plain.status.is_some()
            && (plain.status, &plain.stdout) == (checked.status, &checked.stdout)
            && checked.stderr.starts_with(&plain.stderr);
        (!is_same).then(|| format!("{path}: {plain:?} is not {checked:?}"))
    })
    .into_iter()
    .flatten()
    .collect();
    assert!(paths.len() >= at_least, "{} scripts", paths.len());
    assert!(differences.is_empty(), "{}", differences.join("\n"));
}

#[test]
fn conformance_scripts_print_the_same_with_checks() {
    compare("tests/conformance", 48, &["--profile", "full", "--neighbor", "2,10,0.5,0"]);
}

#[test]
fn examples_print_the_same_with_checks() {
    compare("examples", 20, &["--robot", "kilobot", "--neighbor", "2,10,0.5,0"]);
}
