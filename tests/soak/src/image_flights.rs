//! Flights of the Crazyflie's image under disturbances and faults, its accuracy, and the times of its
//! samples, in emulation. A file that is committed keeps what each item printed, and docs/flight.md is
//! written from it.

use crate::Verdict;
use crate::flights::Printed;
use anyhow::{Context, Result};
use bittybuzz_builds::board::CRAZYFLIE;
use bittybuzz_builds::cargo_test::image_tests;
use bittybuzz_builds::shell::{Invocation, root};
use fs_err as fs;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::ops::Range;

/// The file, from the root.
pub const FILE: &str = "tests/soak/image_flights.toml";

const HEAD: &str = "\
# Flights of the Crazyflie's image in emulation: what each item of `cargo xtask soak image_flights` printed.
# docs/flight.md quotes it.
";

/// Path prefixes of the files that the flights are about.
pub const MADE_OF: &[&str] = &[
    "arena/src/",
    "comms/",
    "emulation/",
    "emulators/stm32/",
    "examples/flight/",
    "firmware/",
    "flight/src/",
    "robots/crazyflie/",
    "tests/hil/src/",
    "tests/hil/tests/flight.rs",
    "tests/hil/tests/flight_examples.rs",
    "tests/hil/tests/image_flights/",
    "vm-core/src/",
];

/// A kind of flights.
struct Suite {
    name: &'static str,
    /// The test that flies them, in the module `image_flights`.
    test: &'static str,
    numbers: Range<u32>,
    /// Flights of one item.
    block: usize,
}

const SUITES: [Suite; 6] = [
    // Two seeds of five flights each.
    Suite { name: "figures", test: "figures::fresh_figures", numbers: 1..11, block: 2 },
    Suite {
        name: "disturbances",
        test: "disturbances::fresh_flights_under_disturbances",
        numbers: 30_000..30_200,
        block: 10,
    },
    Suite {
        name: "faults",
        test: "faults::fresh_flights_with_a_fault",
        numbers: 6_000..6_100,
        block: 10,
    },
    Suite {
        name: "exhibition",
        test: "exhibition::robots_stay_apart_in_fresh_seeds",
        numbers: 1..21,
        block: 1,
    },
    Suite {
        name: "five minutes in flight",
        test: "samples::a_flight_of_five_minutes_answers_each_pulse",
        numbers: 0..1,
        block: 1,
    },
    Suite {
        name: "1,000 s armed",
        test: "samples::an_armed_robot_answers_each_pulse",
        numbers: 0..1,
        block: 1,
    },
];

/// What an item printed.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Flights {
    /// The day of the run, as `YYYY-MM-DD`.
    date: String,
    counts: BTreeMap<String, u32>,
    /// The largest value by figure.
    worst: BTreeMap<String, f64>,
    /// The values of the flights by figure.
    figures: BTreeMap<String, Vec<f64>>,
}

impl Suite {
    /// Returns the names of its items.
    fn items(&self) -> Vec<String> {
        let starts = self.numbers.clone().step_by(self.block);
        let item = |start: u32| format!("{} {start}..{}", self.name, start + self.block as u32);
        starts.map(item).collect()
    }
}

/// Names of all items.
pub fn items() -> Vec<String> {
    SUITES.iter().flat_map(Suite::items).collect()
}

/// Flies an item.
pub fn run(item: &str) -> Result<Verdict> {
    let known = |suite: &&Suite| suite.items().iter().any(|name| name == item);
    let Some(suite) = SUITES.iter().find(known) else {
        return Ok(Verdict::Missing("there is no such item".to_owned()));
    };
    let (_, numbers) = item.rsplit_once(' ').context("an item has numbers")?;
    let image = CRAZYFLIE.build(None, false)?;
    let test = format!("image_flights::{}", suite.test);
    let output = image_tests(&["--exact", &test, "--ignored", "--nocapture"])?
        .env("BITTYBUZZ_CRAZYFLIE", &image.display().to_string())
        .env("BITTYBUZZ_FLIGHTS", numbers)
        .output_if(|output| output.status.code().is_some())?;
    let text = String::from_utf8_lossy(&output.stdout);
    let printed = Printed::read(&text);
    if !output.status.success() || printed.is_empty() {
        // The file has what was shown only; the output names the flights and their numbers.
        return Ok(Verdict::Missing(text.into_owned()));
    }
    let date = Invocation::new("date", &["+%F"]).unannounced().output(0)?;
    let date = String::from_utf8(date.stdout)?.trim().to_owned();
    let path = root().join(FILE);
    let mut all = parse(&fs::read_to_string(&path)?)?;
    let evidence = format!("{:?} {:?} {:?}", printed.counts, printed.worst, printed.figures);
    all.insert(item.to_owned(), Flights::of(printed, date));
    fs::write(path, format!("{HEAD}\n{}", toml::to_string(&all)?))?;
    Ok(Verdict::Shown(evidence))
}

fn parse(text: &str) -> Result<BTreeMap<String, Flights>> {
    toml::from_str(text).with_context(|| format!("{FILE} is not as `soak image_flights` writes it"))
}

impl Flights {
    fn of(printed: Printed, date: String) -> Flights {
        let worst = printed.worst.into_iter().map(|(figure, value, _)| (figure, value)).collect();
        let mut figures: BTreeMap<String, Vec<f64>> = BTreeMap::new();
        for (figure, value, _) in printed.figures {
            figures.entry(figure).or_default().push(value);
        }
        Flights { date, counts: printed.counts, worst, figures }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_flight_is_in_one_item() {
        let items = items();
        assert_eq!(items.len(), 5 + 20 + 10 + 20 + 2);
        assert_eq!(items[0], "figures 1..3");
        assert_eq!(items[5], "disturbances 30000..30010");
        assert_eq!(items[34], "faults 6090..6100");
    }

    #[test]
    fn the_file_is_read_and_holds_items() {
        let all = parse(&fs::read_to_string(root().join(FILE)).unwrap()).unwrap();
        assert!(all.keys().all(|name| items().contains(name)), "{:?}", all.keys());
    }

    #[test]
    fn an_item_keeps_what_was_printed() {
        let text = "figure: mm rms, hover = 1.66 in flight 1\nfigure: mm rms, hover = 1.5 in flight 2\n\
                    worst: mm of error = 40 in flight 7\ncount: end early = 0\n";
        let flights = Flights::of(Printed::read(text), "2026-11-28".to_owned());
        assert_eq!(flights.figures["mm rms, hover"], [1.66, 1.5]);
        assert_eq!((flights.worst["mm of error"], flights.counts["end early"]), (40.0, 0));
    }
}
