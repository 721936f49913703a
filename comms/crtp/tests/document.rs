//! Compares docs/crtp.md with the tables of the code.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use bittybuzz_crtp::{Access, LogVariable, Parameter, Refusal};

/// Returns the text of the page, after an update of its table if that is wanted.
fn page() -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/crtp.md");
    let page = fs::read_to_string(&path).unwrap();
    let (start, rest) = page.split_once("single value says").unwrap();
    let (sentence, rest) = rest.split_once("\n\n").unwrap();
    let (_, end) = rest.split_once("\n\n## Log variables").unwrap();
    let new =
        format!("{start}single value says{sentence}\n\n{}\n\n## Log variables{end}", parameters());
    if std::env::var_os("UPDATE_DOCS").is_some() {
        fs::write(&path, new).unwrap();
        return fs::read_to_string(&path).unwrap();
    }
    assert!(new == page, "UPDATE_DOCS=1 cargo test -p bittybuzz-crtp writes docs/crtp.md");
    page
}

/// Returns the table of the parameters.
fn parameters() -> String {
    let mut table = String::from("| Parameter | First value | Range | Change |\n|---|---|---|---|");
    for parameter in Parameter::ALL {
        let (group, name, first) = (parameter.group(), parameter.name(), parameter.first());
        let (least, most) = parameter.range();
        let change = match parameter.access() {
            Access::ReadOnly => "by the robot",
            Access::Always => "always",
            Access::OnGround => "on the ground",
            Access::UpperLimit => "upper limit",
            Access::LowerLimit => "lower limit",
        };
        let range = match parameter.access() {
            Access::ReadOnly => String::new(),
            _ if least == most => format!("{least}"),
            _ => format!("{least} to {most}"),
        };
        write!(table, "\n| `{group}.{name}` | {first} | {range} | {change} |").unwrap();
    }
    table
}

#[test]
fn the_page_has_the_tables_of_the_code() {
    let page = page();
    for reason in Refusal::ALL {
        assert!(page.contains(&format!("\n| `{reason:?}` | ")), "{reason:?}");
    }
    let (_, logs) = page.split_once("## Log variables").unwrap();
    let sentence = logs.trim_start().lines().next().unwrap();
    for variable in LogVariable::ALL {
        assert!(sentence.contains(&format!("`{}`", variable.group())), "{variable:?}");
    }
    assert_eq!(sentence.matches('`').count() / 2, 15, "groups");
}
