//! Unicorn and simavr are under the GPL. Programs that link them are under it too, and nothing else links them.

#![allow(clippy::unwrap_used, reason = "what fails here fails the test")]

use std::fs;
use std::path::Path;

use bittybuzz_builds::shell::Line;
use serde_json::Value;

/// The library around each engine, and the only package that may depend on it.
const ENGINES: [(&str, &str, &str); 2] = [
    ("bittybuzz-unicorn", "bittybuzz-emulate-stm32", "GPL-2.0-only"),
    ("bittybuzz-simavr", "bittybuzz-emulate-avr", "GPL-3.0-or-later"),
];
/// Tests of all cores: their program is given to nobody.
const TESTS: &str = "bittybuzz-core-tests";

fn packages() -> Vec<Value> {
    let arguments = ["metadata", "--no-deps", "--format-version", "1"];
    let output = Line::new("cargo", &arguments).output(0).unwrap();
    let metadata: Value = serde_json::from_slice(&output.stdout).unwrap();
    metadata["packages"].as_array().unwrap().clone()
}

/// The packages that depend on `name`, and whether only for tests.
fn dependents(packages: &[Value], name: &str) -> Vec<(String, bool)> {
    let mut found = Vec::new();
    for package in packages {
        for dependency in package["dependencies"].as_array().unwrap() {
            if dependency["name"] == name {
                let user = package["name"].as_str().unwrap().to_owned();
                found.push((user, dependency["kind"] == "dev"));
            }
        }
    }
    found
}

#[test]
fn only_programs_under_the_gpl_link_its_engines() {
    let packages = packages();
    for (library, program, licence) in ENGINES {
        let users = dependents(&packages, library);
        assert!(users.contains(&(program.to_owned(), false)), "{library}: {users:?}");
        for (user, is_test) in users {
            let is_allowed = user == program || user == TESTS && is_test;
            assert!(is_allowed, "{user} must not depend on {library}, which is under the GPL");
        }
        // The program in turn is linked to nothing.
        assert_eq!(dependents(&packages, program), [], "{program} is a program, not a library");
        for name in [library, program] {
            let package = packages.iter().find(|package| package["name"] == name).unwrap();
            assert_eq!(package["license"], licence, "{name}");
            let folder = Path::new(package["manifest_path"].as_str().unwrap()).parent().unwrap();
            let text = fs::read_to_string(folder.join("COPYING")).unwrap();
            let version = if licence == "GPL-2.0-only" { "Version 2," } else { "Version 3," };
            let is_whole = text.contains("GNU GENERAL PUBLIC LICENSE")
                && text.contains(version)
                && text.contains("END OF TERMS AND CONDITIONS");
            assert!(is_whole, "{}/COPYING is not the text of {licence}", folder.display());
        }
    }
    assert_eq!(dependents(&packages, "unicorn-engine"), [("bittybuzz-unicorn".to_owned(), false)]);
    for package in &packages {
        let manifest = Path::new(package["manifest_path"].as_str().unwrap());
        let script = manifest.with_file_name("build.rs");
        let links = fs::read_to_string(script).is_ok_and(|text| text.contains("link-lib=simavr"));
        assert_eq!(links, package["name"] == "bittybuzz-simavr", "{}", package["name"]);
    }
}
