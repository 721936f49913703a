//! Compares the tables of evidence in docs/testing.md with docs/evidence.toml.

use crate::generated::{check, path};
use fs_err as fs;
use std::collections::BTreeMap;
use toml::Table;

#[test]
fn the_tables_of_evidence_are_those_of_the_file() {
    let file: Table = fs::read_to_string(path("docs/evidence.toml")).unwrap().parse().unwrap();
    let mut sections: BTreeMap<&str, String> = BTreeMap::new();
    for claim in file["claim"].as_array().unwrap() {
        let text = |key: &str| claim.get(key).map(|value| value.as_str().unwrap());
        let [section, title, command, date] =
            ["section", "claim", "command", "date"].map(|key| text(key).unwrap());
        let commit = text("commit").map_or(String::new(), |commit| format!(", {commit}"));
        let head = "\n| Claim | Command | Date, commit |\n|---|---|---|\n";
        let command = command
            .replace("cargo xtask ", "")
            .replace("cargo test --locked -p bittybuzz-", "test ")
            .replace("cargo run --locked --release -p bittybuzz-", "run ")
            .replace("test crazyflie-physics --test crazyflie-physics ", "physics ");
        *sections.entry(section).or_insert_with(|| head.to_owned()) +=
            &format!("| {title} | `{command}` | {date}{commit} |\n");
    }
    let parts: Vec<_> =
        sections.into_iter().map(|(section, rows)| (section, rows + "\n")).collect();
    check("docs/testing.md", "evidence.rs", &parts);
}
