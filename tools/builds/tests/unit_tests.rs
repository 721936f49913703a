//! A library with `test = false` is not compiled once more for unit tests. It must have none: cargo would
//! not run them.

use std::fs;
use std::path::Path;

use bittybuzz_builds::shell::{Invocation, root};
use serde_json::Value;

/// Returns the files below a folder that have the attribute of a test.
fn files_with_tests(folder: &Path, found: &mut Vec<String>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files_with_tests(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs")
            && has_test(&fs::read_to_string(&path).unwrap())
        {
            found.push(path.strip_prefix(root()).unwrap().display().to_string());
        }
    }
}

fn has_test(text: &str) -> bool {
    text.lines().any(|line| line.trim() == "#[test]" || line.trim_start().starts_with("proptest!"))
}

#[test]
fn libraries_that_are_not_tested_have_no_unit_tests() {
    let arguments = ["metadata", "--no-deps", "--format-version", "1"];
    let output = Invocation::new("cargo", &arguments).output(0).unwrap();
    let metadata: Value = serde_json::from_slice(&output.stdout).unwrap();
    let mut found = Vec::new();
    let mut untested = 0;
    for package in metadata["packages"].as_array().unwrap() {
        let targets = package["targets"].as_array().unwrap().iter();
        let libraries = targets.filter(|target| {
            let kind = target["kind"][0].as_str().unwrap();
            target["test"] == false && (kind == "lib" || kind == "proc-macro")
        });
        for library in libraries {
            let path = Path::new(library["src_path"].as_str().unwrap());
            files_with_tests(path.parent().unwrap(), &mut found);
            untested += 1;
        }
    }
    assert!(found.is_empty(), "`test = false` in the manifest hides these tests: {found:?}");
    assert!(untested > 0);
}

#[test]
fn tests_are_found() {
    assert!(has_test("mod tests {\n    #[test]\n    fn a() {}\n}\n"));
    assert!(!has_test("/// `#[test]` marks a test.\nfn test() {}\n"));
}
