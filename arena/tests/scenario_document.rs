//! docs/scenario.md describes every key, and nothing else.

use std::fmt::Write;
use std::path::Path;

use bittybuzz_arena::scenario::Scenario;
use bittybuzz_arena::scenario::keys::{BODY, SECTIONS, SectionKey, SectionKeys};

const DOCUMENT: &str = include_str!("../../docs/scenario.md");

/// The sections of every scenario, and those of the robots that ship.
fn sections() -> Vec<SectionKeys> {
    let models = bittybuzz_robot_models::all();
    let keys = models.iter().map(|model| {
        let (name, help) = (model.name(), model.keys().robots);
        SectionKey { name, takes: "table", default: "", help }
    });
    let body = SectionKeys { name: BODY, keys: keys.collect::<Vec<_>>().leak() };
    let of_models = models.iter().map(|model| model.keys().body);
    SECTIONS.iter().copied().chain([body]).chain(of_models).collect()
}

/// The table of a section, as the document has it.
fn table(section: &SectionKeys) -> String {
    let mut table = "| Key | Takes | Without it | Meaning |\n|---|---|---|---|\n".to_owned();
    for key in section.keys {
        let default = if key.default.is_empty() { "" } else { key.default };
        let _ = writeln!(table, "| `{}` | {} | {default} | {} |", key.name, key.takes, key.help);
    }
    table
}

#[test]
fn documented_keys_agree_with_the_code() {
    for section in &sections() {
        assert!(
            DOCUMENT.contains(&table(section)),
            "docs/scenario.md needs this table for {}:\n{}",
            section.name,
            table(section)
        );
    }
    // Other tables have fewer columns.
    let is_key = |line: &&str| line.starts_with("| `") && line.matches(" | ").count() == 3;
    let rows = DOCUMENT.lines().filter(is_key).count();
    let mut keys: usize = sections().iter().map(|section| section.keys.len()).sum();
    // The radios and the link of described robots share a table.
    for shared in ["[medium.p2p]", "[medium.rab]"] {
        let section = SECTIONS.iter().find(|section| section.name == shared);
        keys -= section.map_or(0, |section| section.keys.len());
    }
    assert_eq!(rows, keys, "docs/scenario.md has rows for keys that do not exist");
}

#[test]
fn every_quantity_is_described() {
    for form in bittybuzz_arena::scenario::QUANTITIES {
        assert!(DOCUMENT.contains(&format!("* `{form}`")), "{form}");
    }
}

#[test]
fn the_documented_example_is_a_valid_scenario() {
    let start = DOCUMENT.find("```toml\n").map_or(0, |at| at + "```toml\n".len());
    let text = &DOCUMENT[start..];
    let text = &text[..text.find("```").unwrap_or(0)];
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples");
    let read = Scenario::parse(text, "example", &examples, &[], &bittybuzz_robot_models::all());
    let scenario = read.unwrap_or_else(|errors| panic!("{errors:#?}"));
    assert_eq!(scenario.groups.len(), 2);
    assert!(!scenario.events.is_empty() && !scenario.expects.is_empty());
}
