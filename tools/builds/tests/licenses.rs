//! Unicorn and simavr are under the GPL. The programs that link them must be under the GPL as well,
//! and no other package may link them.

use std::fs;
use std::path::Path;

use bittybuzz_builds::shell::Invocation;
use serde_json::Value;

/// The library around each engine, the only package that may depend on the library, and its
/// license.
const ENGINES: [(&str, &str, &str); 2] = [
    ("bittybuzz-unicorn", "bittybuzz-emulate-stm32", "GPL-2.0-only"),
    ("bittybuzz-simavr", "bittybuzz-emulate-avr", "GPL-3.0-or-later"),
];
/// The tests of all cores, whose program is not distributed.
const TESTS: &str = "bittybuzz-core-tests";

fn packages() -> Vec<Value> {
    let arguments = ["metadata", "--no-deps", "--format-version", "1"];
    let output = Invocation::new("cargo", &arguments).output(0).unwrap();
    let metadata: Value = serde_json::from_slice(&output.stdout).unwrap();
    metadata["packages"].as_array().unwrap().clone()
}

/// Returns the packages that depend on `name`, each with true if only its tests do.
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
    for (library, program, license) in ENGINES {
        let users = dependents(&packages, library);
        assert!(users.contains(&(program.to_owned(), false)), "{library}: {users:?}");
        for (user, is_test) in users {
            let is_allowed = user == program || user == TESTS && is_test;
            assert!(is_allowed, "{user} must not depend on {library}, which is under the GPL");
        }
        // No package may link the program itself.
        assert_eq!(dependents(&packages, program), [], "{program} is a program, not a library");
        for name in [library, program] {
            let package = packages.iter().find(|package| package["name"] == name).unwrap();
            assert_eq!(package["license"], license, "{name}");
            let folder = Path::new(package["manifest_path"].as_str().unwrap()).parent().unwrap();
            let text = fs::read_to_string(folder.join("COPYING")).unwrap();
            let version = if license == "GPL-2.0-only" { "Version 2," } else { "Version 3," };
            let is_whole = text.contains("GNU GENERAL PUBLIC LICENSE")
                && text.contains(version)
                && text.contains("END OF TERMS AND CONDITIONS");
            assert!(is_whole, "{}/COPYING is not the text of {license}", folder.display());
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
