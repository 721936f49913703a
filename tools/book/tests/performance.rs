//! Compares the tables of docs/performance.md with the recorded counts of `bench/`. `UPDATE_DOCS=1
//! cargo test --locked -p bittybuzz-book` writes the tables again.

use fs_err as fs;
use serde_json::Value;
use std::env;
use std::path::{Path, PathBuf};
use toml::Table;

fn path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(name)
}

fn table(name: &str) -> Table {
    fs::read_to_string(path(name)).unwrap().parse().unwrap()
}

fn entries<'a>(table: &'a Table, key: &str) -> Vec<&'a Table> {
    table[key].as_array().unwrap().iter().map(|entry| entry.as_table().unwrap()).collect()
}

#[test]
fn tables_are_those_of_the_recorded_counts() {
    let page = path("docs/performance.md");
    let before = fs::read_to_string(&page).unwrap();
    let mut text = before.clone();
    for (name, block) in [("means", means()), ("peers", peers()), ("flight", flight())] {
        let start = format!("<!-- {name}: written by tools/book/tests/performance.rs -->\n");
        let (head, rest) = text.split_once(&start).unwrap();
        let (_, tail) = rest.split_once("<!-- end -->\n").unwrap();
        text = format!("{head}{start}{block}<!-- end -->\n{tail}");
    }
    if env::var_os("UPDATE_DOCS").is_some() {
        fs::write(&page, &text).unwrap();
    }
    let committed = fs::read_to_string(&page).unwrap();
    assert!(
        committed == text,
        "docs/performance.md is not that of bench/; see the head of this test"
    );
}

/// Returns the counts of BittyBuzz in Rust on a target.
fn baseline(target: &str) -> Value {
    let text = fs::read_to_string(path("bench/baseline.json")).unwrap();
    serde_json::from_str::<Value>(&text).unwrap()[target].take()
}

fn count(counts: &Value, script: &str) -> Option<f64> {
    counts[script]["count"].as_f64()
}

fn geometric_mean(ratios: &[f64]) -> f64 {
    (ratios.iter().map(|ratio| ratio.ln()).sum::<f64>() / ratios.len() as f64).exp()
}

/// Formats a number with commas between thousands.
fn number(value: f64) -> String {
    let digits = format!("{value:.0}");
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// Scripts that use messages or positions of neighbors.
const WITH_NEIGHBORS: [&str; 4] = ["gradient", "neigh8", "neighred8", "messages8"];

const TARGETS: [(&str, &str); 4] = [
    ("avr", "ATmega328P, cycles"),
    ("thumbv6m", "Cortex-M0, instructions"),
    ("thumbv7em", "Cortex-M4F, instructions"),
    ("host", "x86-64, instructions"),
];

fn means() -> String {
    let reference = table("bench/reference.toml");
    let mut text = "\n| Target | Mean over all scripts | Mean without neighbors | Least |\n|---|---|---|---|\n".to_owned();
    for (target, title) in TARGETS {
        let ours = baseline(target);
        let ratios: Vec<(&str, f64)> = entries(&reference, "script")
            .iter()
            .filter_map(|script| {
                let name = script["name"].as_str()?;
                Some((name, script.get(target)?.as_integer()? as f64 / count(&ours, name)?))
            })
            .collect();
        let all: Vec<f64> = ratios.iter().map(|(_, ratio)| *ratio).collect();
        let alone = ratios.iter().filter(|(name, _)| !WITH_NEIGHBORS.contains(name));
        let alone: Vec<f64> = alone.map(|(_, ratio)| *ratio).collect();
        let least = ratios.iter().min_by(|one, other| one.1.total_cmp(&other.1)).unwrap();
        text += &format!(
            "| {title} | {:.0} times fewer ({}) | {:.0} ({}) | {:.0} (`{}`) |\n",
            geometric_mean(&all),
            all.len(),
            geometric_mean(&alone),
            alone.len(),
            least.1,
            least.0
        );
    }
    text + "\n"
}

/// Scripts of the table of other interpreters.
const COMPARED: [&str; 8] =
    ["empty", "fib10", "tak", "loopsum", "table16", "method", "float", "gradient"];

fn peers() -> String {
    let recorded = table("bench/peers.toml");
    let columns = COMPARED.map(|name| format!("`{name}`")).join(" | ");
    let head = format!(
        "| Interpreter | {columns} | Flash |\n|---|{}---|\n",
        "---|".repeat(COMPARED.len())
    );
    let row = |title: String, counts: &dyn Fn(&str) -> Option<f64>, flash: Option<f64>| {
        let cells = COMPARED.map(|name| counts(name).map_or(String::new(), number)).join(" | ");
        format!("| {title} | {cells} | {} |\n", flash.map_or(String::new(), number))
    };
    let mut text = String::new();
    let arm = baseline("thumbv7em-full");
    let avr = baseline("avr");
    for (core, title, ours) in [
        ("Cortex-M4F", "Cortex-M4F, instructions of a step", &arm),
        ("AVR", "AVR, cycles of a step; BittyBuzz has profile `tiny`", &avr),
    ] {
        text += &format!("\n**{title}**\n\n{head}");
        text += &row("BittyBuzz in Rust".to_owned(), &|name| count(ours, name), None);
        for peer in entries(&recorded, "peer") {
            let is_here = peer["target"].as_str().unwrap().starts_with(core);
            let counts = peer.get("count").and_then(toml::Value::as_table);
            let (true, Some(counts)) = (is_here, counts) else { continue };
            let name =
                format!("{} {}", peer["name"].as_str().unwrap(), peer["version"].as_str().unwrap());
            let flags = peer["flags"].as_str().unwrap();
            // The first option belongs to the interpreter.
            let option = flags.split([' ', ',']).find(|option| option.starts_with("-O"));
            let title =
                format!("{name}{}", option.map_or(String::new(), |option| format!(", {option}")));
            let integer = |value: &toml::Value| value.as_integer().map(|value| value as f64);
            let flash = ["flash_bytes", "flash_whole_image_bytes"];
            let flash = flash.iter().find_map(|key| peer.get(*key).and_then(integer));
            text += &row(title, &|script| counts.get(script).and_then(integer), flash);
        }
    }
    text + "\n"
}

fn flight() -> String {
    let recorded = fs::read_to_string(path("bench/flight.json")).unwrap();
    let recorded: Value = serde_json::from_str(&recorded).unwrap();
    let cell = |value: &Value| value.as_f64().map_or(String::new(), number);
    let mut text = String::new();
    for (name, title) in [("pose", "Poses from outside"), ("deck", "Flow deck")] {
        let flight = &recorded[name];
        text += &format!(
            "\n**{title}**\n\n| Task | Per second | Instructions, mean | Most |\n|---|---|---|---|\n"
        );
        for (task, cost) in flight["tasks"].as_object().unwrap() {
            let [per_second, mean, most] =
                ["per_second", "mean", "most"].map(|key| cell(&cost[key]));
            // Tasks of the start alone have no rate.
            if per_second != "0" {
                text += &format!("| {task} | {per_second} | {mean} | {most} |\n");
            }
        }
        let [all, most] = ["per_second", "most_in_ms"].map(|key| cell(&flight[key]));
        text += &format!("| all, in a second | | {all} | |\n| all, in 1 ms | | | {most} |\n");
    }
    text + "\n"
}
