//! docs/diagnostics.md: a section for every code, and examples that really give that code.

use std::collections::BTreeSet;
use std::path::Path;

use bittybuzz_compiler::codes::DiagnosticCode;
use bittybuzz_compiler::compile::{Options, compile};
use bittybuzz_compiler::explain::{explain, sections};
use bittybuzz_compiler::include::{IncludeLoader, MemoryFiles, SOURCE_BYTES_MAX};

#[test]
fn every_code_has_a_section_and_every_section_a_code() {
    let codes: Vec<&str> = DiagnosticCode::ALL.iter().map(|code| code.text()).collect();
    let explained: Vec<&str> = sections().map(|(code, _)| code).collect();
    let missing: Vec<_> = codes.iter().filter(|code| !explained.contains(code)).collect();
    let unknown: Vec<_> = explained.iter().filter(|code| !codes.contains(code)).collect();
    assert!(missing.is_empty() && unknown.is_empty(), "missing {missing:?}, unknown {unknown:?}");
    assert_eq!(explained, codes, "sections stand in the order of the codes");
}

#[test]
fn codes_are_unique_and_in_order() {
    let codes: Vec<&str> = DiagnosticCode::ALL.iter().map(|code| code.text()).collect();
    let sorted: BTreeSet<&str> = codes.iter().copied().collect();
    assert!(sorted.into_iter().eq(codes));
}

#[test]
fn headings_are_the_titles() {
    for code in explained() {
        let section = explain(code.text()).unwrap();
        let heading = section.lines().next().unwrap();
        assert_eq!(heading, format!("## {} — {}", code.text(), code.title()));
    }
}

/// What takes a very long script, a robot of its own, or a mistake in the compiler to happen.
const WITHOUT_EXAMPLE: [&str; 9] =
    ["E0602", "E0603", "E0604", "E0605", "E0606", "E0607", "E0608", "E0609", "E0699"];

#[test]
fn sections_explain_the_meaning_and_the_fix() {
    for code in explained().filter(|code| !WITHOUT_EXAMPLE.contains(&code.text())) {
        let (before, _, after) = parts(code);
        assert!(before.lines().count() > 2, "{}: what it means", code.text());
        assert!(!after.trim().is_empty(), "{}: how to mend it", code.text());
    }
}

#[test]
fn examples_give_the_code_that_they_explain() {
    for code in explained().filter(|code| !WITHOUT_EXAMPLE.contains(&code.text())) {
        let (_, example, _) = parts(code);
        let found = codes_of(example);
        assert!(found.contains(&code), "{}:\n{example}\ngives {found:?}", code.text());
    }
}

#[test]
fn explain_ignores_case_and_refuses_unknown_codes() {
    assert_eq!(explain("e0101"), explain("E0101"));
    assert!(explain("E0101").is_some_and(|text| !text.contains("E0102")));
    for unknown in ["", "E", "E9999", "0101", "Diagnostics", "E0101 —"] {
        assert_eq!(explain(unknown), None, "{unknown}");
    }
}

fn explained() -> impl Iterator<Item = DiagnosticCode> {
    DiagnosticCode::ALL.iter().copied().filter(|code| explain(code.text()).is_some())
}

/// A section before its example, the example with the rest of its fence line (the robot it is built for), and what
/// follows it.
fn parts(code: DiagnosticCode) -> (&'static str, &'static str, &'static str) {
    let section = explain(code.text()).unwrap_or_default();
    let parts = section.split_once("```buzz").and_then(|(before, rest)| {
        rest.split_once("\n```").map(|(example, after)| (before, example, after))
    });
    parts.unwrap_or_else(|| panic!("{} has no example", code.text()))
}

/// Everything that the compiler says about a script, which has the files that the examples speak of.
fn codes_of(example: &str) -> Vec<DiagnosticCode> {
    let (robot, text) = example.split_once('\n').unwrap_or(("", example));
    let files = MemoryFiles::default()
        .with("common.bzz", "common = 1")
        .with("latin1.bzz", b"# caf\xe9".as_slice())
        .with("huge.bzz", vec![b'\n'; SOURCE_BYTES_MAX + 1])
        .with_unreadable("unreadable.bzz");
    let main = Path::new("scripts/main.bzz");
    let robots = bittybuzz_robot_files::all_shipped();
    let robot = robots.iter().find(|known| known.name == robot.trim()).cloned();
    let options = Options { robot, robots, ..Options::default() };
    let compiled = compile(main, text.to_owned(), &IncludeLoader::new(&files), &options);
    compiled.diagnostics.iter().map(|diagnostic| diagnostic.code).collect()
}
