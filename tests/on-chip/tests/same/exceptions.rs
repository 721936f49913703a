//! The conformance scripts, which end everywhere as the reference says, but for those in `exceptions.toml`.

use crate::programs::{self, Program};
use crate::target::Target;
use bittybuzz_on_chip::End;
use bittybuzz_tests::files;
use serde::Deserialize;

const FILE: &str = "tests/on-chip/exceptions.toml";

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct List {
    exception: Vec<Exception>,
}

/// A script that ends in another way, or does not compile. What it does is compared all the same.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Exception {
    script: String,
    /// Where; everywhere if there are none.
    #[serde(default)]
    targets: Vec<String>,
    #[allow(dead_code, reason = "for whoever reads the list; it must be there")]
    reason: String,
}

/// All that compile; those that end in an unexpected way, and exceptions without need.
pub fn conformance(target: &Target) -> (Vec<Program>, Vec<String>) {
    let list: List = toml::from_str(&files::read(FILE)).unwrap_or_else(|e| panic!("{FILE}: {e}"));
    let is_for = |exception: &&Exception| {
        exception.targets.is_empty() || exception.targets.iter().any(|name| name == target.name)
    };
    let excepted: Vec<&str> = list.exception.iter().filter(is_for).map(|e| &*e.script).collect();
    let mut scripts = Vec::new();
    let mut failures = Vec::new();
    for (name, program) in programs::conformance(target.full) {
        let problem = match &program {
            Some(program) => ends_differently(target, program),
            None => Some("it does not compile".to_owned()),
        };
        match (problem, excepted.contains(&name.as_str())) {
            (Some(problem), false) => failures.push(format!("{name}: {problem}\n")),
            (None, true) => failures.push(format!("{name}: needs no exception in {FILE}\n")),
            _ => {}
        }
        scripts.extend(program);
    }
    (scripts, failures)
}

fn ends_differently(target: &Target, program: &Program) -> Option<String> {
    let expect = files::read(&format!("{}/{}.expect", programs::CONFORMANCE, program.name));
    let end = target.expected(program.header, &program.image).end;
    let is_expected = match end {
        End::Complete => expect.starts_with("ok\n"),
        End::Fault(_) => expect.starts_with("runtime-error\n"),
        End::GivenUp | End::Refused(_) => false,
    };
    (!is_expected).then(|| format!("ends with {end:?}"))
}
