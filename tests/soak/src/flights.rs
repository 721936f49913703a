//! Flights of the flight controller with numbers that no limit was chosen with: faults and
//! disturbances in the physics of a Crazyflie. The worst value of each figure stays with its flight in a
//! file that is committed, from which docs/flight.md is written; each run goes on with the next
//! numbers.

use crate::Verdict;
use anyhow::{Context, Result};
use bittybuzz_builds::cargo_test::all_tests;
use bittybuzz_builds::shell::{Invocation, root};
use fs_err as fs;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::ops::Range;

/// The file, from the root.
pub const FILE: &str = "tests/soak/flights.toml";

const HEAD: &str = "\
# Flights with a fault or a disturbance whose numbers no limit was chosen with: counts, and the worst value of each figure.
# `cargo xtask soak flights` adds to this file, and docs/flight.md quotes it.
";

/// Flights of one run.
const FLIGHTS: u32 = 500;

/// Path prefixes of the files that the flights are about.
pub const MADE_OF: &[&str] =
    &["flight/src/", "robots/crazyflie/physics/", "tests/soak/src/flights.rs"];

/// A kind of flights.
struct Suite {
    name: &'static str,
    /// The test that flies them.
    test: &'static str,
    /// The number of the first flight. Limits of the flight controller were chosen with lower ones.
    first: u32,
}

const SUITES: [Suite; 2] = [
    Suite {
        name: "disturbances",
        test: "disturbances::fresh_flights_under_disturbances",
        first: 20_000,
    },
    Suite { name: "faults", test: "faults::fresh_flights_with_a_fault", first: 4_000 },
];

/// The largest value of a figure.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Worst {
    value: f64,
    /// The number of its flight.
    flight: u32,
    /// The day of the flight, as `YYYY-MM-DD`.
    date: String,
}

/// The flights of a suite.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Flights {
    /// Flights of all runs.
    flown: u32,
    /// The day of the last run, as `YYYY-MM-DD`.
    date: String,
    /// Flights of all runs by what happened in them.
    counts: BTreeMap<String, u32>,
    /// The worst of all runs by figure.
    worst: BTreeMap<String, Worst>,
}

/// The flights of all suites by their names.
type Suites = BTreeMap<String, Flights>;

/// The figures and counts that a test prints.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Printed {
    pub worst: Vec<(String, f64, u32)>,
    pub counts: BTreeMap<String, u32>,
    /// The figures of single flights.
    pub figures: Vec<(String, f64, u32)>,
}

/// Names of all suites.
pub fn items() -> Vec<String> {
    SUITES.iter().map(|suite| suite.name.to_owned()).collect()
}

/// Flies the next flights of a suite.
pub fn run(name: &str) -> Result<Verdict> {
    let Some(suite) = SUITES.iter().find(|suite| suite.name == name) else {
        return Ok(Verdict::Missing("there is no such suite".to_owned()));
    };
    let path = root().join(FILE);
    let mut suites = parse(&fs::read_to_string(&path)?)?;
    let flights = suites.entry(name.to_owned()).or_default();
    let numbers = flights.next(suite);
    let chosen = ["--exact", suite.test, "--ignored", "--nocapture"];
    let output = all_tests(&["--test", "crazyflie-physics"], &chosen)
        .env("BITTYBUZZ_FLIGHTS", &format!("{}..{}", numbers.start, numbers.end))
        .output_if(|output| output.status.code().is_some())?;
    let text = String::from_utf8_lossy(&output.stdout);
    let printed = Printed::read(&text);
    if printed.worst.is_empty() {
        return Ok(Verdict::Missing(format!("no figures: {text}")));
    }
    let date = Invocation::new("date", &["+%F"]).unannounced().output(0)?;
    flights.add(printed, String::from_utf8(date.stdout)?.trim());
    let evidence =
        format!("to flight {}: {} flown, {:?}", numbers.end - 1, flights.flown, flights.counts);
    fs::write(path, format!("{HEAD}\n{}", toml::to_string(&suites)?))?;
    // A broken limit stays in the file as well.
    Ok(if output.status.success() {
        Verdict::Shown(evidence)
    } else {
        Verdict::Missing(text.into_owned())
    })
}

fn parse(text: &str) -> Result<Suites> {
    toml::from_str(text).with_context(|| format!("{FILE} is not as `soak flights` writes it"))
}

impl Flights {
    /// Returns the numbers of the next flights.
    fn next(&self, suite: &Suite) -> Range<u32> {
        let first = suite.first + self.flown;
        first..first + FLIGHTS
    }

    /// Adds the flights of a run.
    fn add(&mut self, printed: Printed, date: &str) {
        self.flown += FLIGHTS;
        date.clone_into(&mut self.date);
        for (name, count) in printed.counts {
            *self.counts.entry(name).or_default() += count;
        }
        for (figure, value, flight) in printed.worst {
            if self.worst.get(&figure).is_none_or(|known| value > known.value) {
                self.worst.insert(figure, Worst { value, flight, date: date.to_owned() });
            }
        }
    }
}

impl Printed {
    /// Returns true if nothing was printed.
    pub fn is_empty(&self) -> bool {
        *self == Printed::default()
    }

    /// Reads the lines that `robots/crazyflie/physics/tests/fresh.rs` prints.
    pub fn read(text: &str) -> Printed {
        let mut printed = Printed::default();
        for line in text.lines() {
            // With one thread libtest begins the line of the test before it runs, so that its first line follows there.
            let line = line.split_once(" ... ").map_or(line, |(_, line)| line);
            if let Some(worst) = line.strip_prefix("worst: ").and_then(read_worst) {
                printed.worst.push(worst);
            } else if let Some(figure) = line.strip_prefix("figure: ").and_then(read_worst) {
                printed.figures.push(figure);
            } else if let Some(count) = line.strip_prefix("count: ").and_then(read_count) {
                printed.counts.extend([count]);
            }
        }
        printed
    }
}

/// Reads `FIGURE = VALUE in flight NUMBER`.
fn read_worst(text: &str) -> Option<(String, f64, u32)> {
    let (figure, rest) = text.split_once(" = ")?;
    let (value, flight) = rest.split_once(" in flight ")?;
    Some((figure.to_owned(), value.parse().ok()?, flight.parse().ok()?))
}

/// Reads `NAME = COUNT`.
fn read_count(text: &str) -> Option<(String, u32)> {
    let (name, count) = text.split_once(" = ")?;
    Some((name.to_owned(), count.parse().ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    const PRINTED: &str = "\
running 1 test
worst: mm outside the fence = 330 in flight 2133
worst: mm outside the fence = 120 in flight 2200
count: land upright = 417
test faults::fresh_flights_with_a_fault ... ok
";

    #[test]
    fn figures_and_counts_are_read() {
        let printed = Printed::read(PRINTED);
        assert_eq!(printed.worst[0], ("mm outside the fence".to_owned(), 330.0, 2133));
        assert_eq!(printed.counts["land upright"], 417);
        assert_eq!(Printed::read("running 1 test\n"), Printed::default());
        // Of a computer with one processor.
        let alone =
            PRINTED.replacen("worst: ", "test faults::fresh_flights_with_a_fault ... worst: ", 1);
        assert_eq!(Printed::read(&alone), printed);
    }

    #[test]
    fn the_worst_of_all_runs_stays() {
        let mut flights = Flights::default();
        flights.add(Printed::read(PRINTED), "2026-11-27");
        let known = flights.worst["mm outside the fence"].clone();
        assert_eq!(known, Worst { value: 330.0, flight: 2133, date: "2026-11-27".to_owned() });
        let calm = "worst: mm outside the fence = 200 in flight 2600\ncount: land upright = 419\n";
        flights.add(Printed::read(calm), "2026-11-28");
        assert_eq!((flights.flown, flights.counts["land upright"]), (2 * FLIGHTS, 417 + 419));
        assert_eq!(flights.worst["mm outside the fence"], known);
        assert_eq!(flights.next(&SUITES[1]), 5000..5500);
    }

    #[test]
    fn the_file_is_read() {
        let suites = parse(&fs::read_to_string(root().join(FILE)).unwrap()).unwrap();
        assert!(suites.keys().all(|name| items().contains(name)), "{:?}", suites.keys());
    }
}
