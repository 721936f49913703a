//! docs/scenario.md describes every key, and nothing else.

use std::fmt::Write;
use std::path::Path;

use bittybuzz_arena::engine::{Infrared, LinkSettings, Loss, Nrf24Medium, P2p};
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

/// The numbers that stand in the place of missing keys are those of the engine.
#[test]
fn documented_numbers_of_the_media_are_those_of_the_engine() {
    let ir = Infrared::STANDARD;
    let (nrf24, p2p) = (Nrf24Medium::STANDARD.link, P2p::STANDARD.link);
    let loss = |link: &LinkSettings| match link.loss {
        Loss { near, far } if near == far => near.to_string(),
        Loss { near, far } => format!("[{near}, {far}]"),
    };
    assert_eq!((nrf24.range, p2p.range), (None, None));
    let rate = 1e6 / (f64::from(ir.tx_period) * 128.0);
    let of_radio = [
        ("range", "nrf24, p2p: no limit; rab: of the robot file".to_owned()),
        ("loss", format!("nrf24: {}; p2p: {}; rab: of the robot file", loss(&nrf24), loss(&p2p))),
    ];
    let of_ir = [
        ("range", ir.link.range.unwrap().to_string()),
        ("edge", ir.link.edge.to_string()),
        ("loss", loss(&ir.link)),
        ("rate", format!("{rate:.0}")),
        ("distance_error", ir.distance_sigma.to_string()),
        ("clock_error", (100.0 * ir.clock_sigma).to_string()),
    ];
    for (name, rows) in [("[medium.ir]", &of_ir[..]), ("[medium.nrf24]", &of_radio)] {
        let section = SECTIONS.iter().find(|section| section.name == name).unwrap();
        for (key, default) in rows {
            let row = section.keys.iter().find(|row| row.name == *key).unwrap();
            assert_eq!(row.default, default, "{name} {key}");
        }
    }
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
