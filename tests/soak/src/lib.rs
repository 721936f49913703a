//! Evidence that takes too long for every change. The results are kept under `target/soak`, so that a
//! stopped run continues; a result is valid until the sources change to which it applies.

mod bad_inputs;
mod convergence;
mod corpus;
mod day;
mod elsewhere;
mod evidence;
mod examples;
mod executions;
mod executors;
mod flights;
mod floats;
mod fuzz;
mod guides;
mod image_flights;
mod kilobots;
mod mutants;
mod notebooks;
mod pages;
mod properties;
mod protocol;
mod same;
mod simulator;
mod sources;
mod squeeze;
mod squeezed;
mod survivors;
mod zooids;

pub use pages::passed_on as page_passed_on;

use anyhow::{Result, bail, ensure};
use bittybuzz_builds::cargo_test::{all_tests, image_tests};
use bittybuzz_builds::shell::target;
use fs_err as fs;
use sources::Sources;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Instant;

/// A kind of evidence.
struct Part {
    name: &'static str,
    /// Returns the names of all items of evidence.
    items: fn() -> Vec<String>,
    /// Tries to show an item.
    run: fn(&str) -> Result<Verdict>,
    /// Path prefixes of the files that the evidence is about.
    made_of: &'static [&'static str],
}

/// Every file.
const ALL: &[&str] = &[""];
/// Path prefixes of the sources of `bbz sim` and its scenarios.
const SIMULATION: &[&str] = &[
    "Cargo",
    "arena/",
    "bbz/src/",
    "comms/src/",
    "compiler/src/",
    "robots/",
    "spec/",
    "tests/scenarios/",
    "vm-core/src/",
    "tests/soak/src/convergence.rs",
    "tests/soak/src/day.rs",
];

/// The result for an item: the evidence, or the reason why there is none.
enum Verdict {
    Shown(String),
    Missing(String),
}

const PARTS: &[Part] = &[
    Part {
        name: "arm64",
        items: elsewhere::arm_items,
        run: elsewhere::run_arm,
        made_of: elsewhere::MADE_OF,
    },
    Part {
        name: "bad_inputs",
        items: bad_inputs::items,
        run: bad_inputs::run,
        made_of: bad_inputs::MADE_OF,
    },
    Part { name: "claims", items: evidence::items, run: evidence::run, made_of: ALL },
    Part {
        name: "convergence",
        items: convergence::items,
        run: convergence::run,
        made_of: SIMULATION,
    },
    Part { name: "corpus", items: corpus::items, run: corpus::run, made_of: corpus::MADE_OF },
    Part { name: "day", items: day::items, run: day::run, made_of: SIMULATION },
    Part { name: "examples", items: examples::items, run: examples::run, made_of: ALL },
    Part {
        name: "executors",
        items: executors::items,
        run: executors::run,
        made_of: executors::MADE_OF,
    },
    Part { name: "flights", items: flights::items, run: flights::run, made_of: flights::MADE_OF },
    Part { name: "floats", items: floats::items, run: floats::run, made_of: floats::MADE_OF },
    // Each target has a count of executions of its own, until the files change that it exercises.
    Part { name: "fuzz", items: fuzz::items, run: fuzz::run, made_of: ALL },
    // The file with the runs keeps the hashes of the files of each guide.
    Part { name: "guides", items: guides::items, run: guides::run, made_of: ALL },
    Part {
        name: "image_flights",
        items: image_flights::items,
        run: image_flights::run,
        made_of: image_flights::MADE_OF,
    },
    Part { name: "kilobots", items: kilobots::items, run: kilobots::run, made_of: ALL },
    Part { name: "mutants", items: mutants::items, run: mutants::run, made_of: ALL },
    Part {
        name: "noise",
        items: || vec!["a million bytes".to_owned()],
        run: |_| noise(),
        made_of: ALL,
    },
    Part {
        name: "notebooks",
        items: notebooks::items,
        run: notebooks::run,
        made_of: notebooks::MADE_OF,
    },
    Part { name: "page", items: pages::items, run: pages::run, made_of: pages::MADE_OF },
    Part { name: "properties", items: properties::items, run: properties::run, made_of: ALL },
    Part {
        name: "protocol",
        items: protocol::items,
        run: protocol::run,
        made_of: protocol::MADE_OF,
    },
    Part { name: "random", items: blocks, run: random, made_of: ALL },
    Part { name: "same", items: same::items, run: same::run, made_of: ALL },
    Part { name: "squeeze", items: squeeze::items, run: squeeze::run, made_of: squeeze::MADE_OF },
    Part { name: "squeezed", items: squeezed::items, run: squeezed::run, made_of: ALL },
    Part {
        name: "torture",
        items: || vec!["every allocation".to_owned()],
        run: |_| torture(),
        made_of: ALL,
    },
    Part {
        name: "windows",
        items: elsewhere::windows_items,
        run: elsewhere::run_windows,
        made_of: elsewhere::MADE_OF,
    },
    Part { name: "zooids", items: zooids::items, run: zooids::run, made_of: ALL },
];

/// Seeds of random programs, each of which runs in both profiles; CI has those from 0.
const SEEDS: std::ops::Range<u64> = 10_000..14_000;
/// Seeds that one run tries.
const BLOCK: u64 = 500;

/// Names of all parts.
pub fn names() -> Vec<&'static str> {
    PARTS.iter().map(|part| part.name).collect()
}

/// Shows the rest of a part, or of all.
pub fn run(part: Option<&str>) -> Result<()> {
    let parts = PARTS.iter().filter(|known| part.is_none_or(|name| name == known.name));
    let sources = Sources::list()?;
    let mut records = Vec::new();
    for part in parts {
        let record = Record::open(part.name, sources.under(part.made_of).fingerprint()?)?;
        println!("{}: {} left", part.name, record.remaining(part).len());
        records.push((part, record));
    }
    let mut missing = Vec::new();
    for (part, record) in &mut records {
        let remaining = record.remaining(part);
        for (number, item) in remaining.iter().enumerate() {
            let start = Instant::now();
            match (part.run)(item)? {
                Verdict::Shown(evidence) => {
                    println!("{} {item}: {evidence} ({} s)", part.name, start.elapsed().as_secs());
                    record.keep(item, &evidence)?;
                }
                Verdict::Missing(reason) => {
                    println!("{} {item}: NOT SHOWN: {reason}", part.name);
                    missing.push(format!("{} {item} ({reason})", part.name));
                }
            }
            println!("{}: {} left", part.name, remaining.len() - number - 1);
        }
        record.report(part);
        if record.remaining(part).is_empty() {
            evidence::record_part(part.name)?;
        }
    }
    ensure!(missing.is_empty(), "not shown: {}", missing.join(", "));
    Ok(())
}

/// The part of CI's sample with mistakes: some of the mutants. The tests pass without the mutants.
pub fn sample_mistakes() -> Result<()> {
    mutants::sample()
        .iter()
        .try_for_each(|(name, test)| require("mutants", name, |name| mutants::run_one(name, test)))
}

/// The other part of CI's sample: some of the mutants of squeeze, an example with squeeze and without, a
/// thousand steps of one of the Kilobots' examples, and some seeds of the convergence. The tests have the
/// sample of the fuzz targets.
pub fn sample_runs() -> Result<()> {
    for name in squeeze::SAMPLE {
        require("squeeze", name, squeeze::run)?;
    }
    require("squeezed", squeezed::SAMPLE, squeezed::run)?;
    timed("kilobots", kilobots::sample)?;
    timed("convergence", convergence::sample)
}

/// Runs the sample of a part, and prints how long it takes.
fn timed(part: &str, sample: fn() -> Result<()>) -> Result<()> {
    let start = Instant::now();
    sample()?;
    println!("{part}: a sample ({} s)", start.elapsed().as_secs());
    Ok(())
}

/// Fails unless an item of a part is shown.
fn require(part: &str, item: &str, run: impl Fn(&str) -> Result<Verdict>) -> Result<()> {
    let start = Instant::now();
    match run(item)? {
        Verdict::Shown(evidence) => {
            println!("{part} {item}: {evidence} ({} s)", start.elapsed().as_secs());
            Ok(())
        }
        Verdict::Missing(reason) => bail!("not shown: {part} {item} ({reason})"),
    }
}

fn noise() -> Result<Verdict> {
    let image = bittybuzz_builds::board::CRAZYFLIE.build(None, false)?;
    image_tests(&["link::", "swarm::", "resets::", "--ignored", "--nocapture"])?
        .env("BITTYBUZZ_CRAZYFLIE", &image.display().to_string())
        .run()?;
    Ok(Verdict::Shown("no harm".to_owned()))
}

fn blocks() -> Vec<String> {
    let starts = SEEDS.step_by(BLOCK as usize);
    starts.map(|start| format!("{start}..{}", start + BLOCK)).collect()
}

fn random(seeds: &str) -> Result<Verdict> {
    let tests = all_tests(&["--test", "tests"], &["random_programs::"]);
    tests.env("BITTYBUZZ_SEEDS", seeds).run()?;
    Ok(Verdict::Shown("all the same".to_owned()))
}

/// All scripts, with each of their allocations made to fail.
fn torture() -> Result<Verdict> {
    let tests = all_tests(&["--test", "tests"], &["torture::"]);
    tests.env("BITTYBUZZ_TORTURE", "all").run()?;
    Ok(Verdict::Shown("all the same, or a clean fault".to_owned()))
}

/// The evidence of a part.
struct Record {
    path: PathBuf,
    fingerprint: u64,
    /// The evidence of each item.
    shown: BTreeMap<String, String>,
}

impl Record {
    /// Reads the evidence that was kept about these sources.
    fn open(part: &str, fingerprint: u64) -> Result<Record> {
        let path = target()?.join("soak").join(part).join("shown");
        let shown = match path.exists() {
            true => parse(&fs::read_to_string(&path)?, fingerprint),
            false => BTreeMap::new(),
        };
        Ok(Record { path, fingerprint, shown })
    }

    fn remaining(&self, part: &Part) -> Vec<String> {
        (part.items)().into_iter().filter(|item| !self.shown.contains_key(item)).collect()
    }

    fn keep(&mut self, item: &str, evidence: &str) -> Result<()> {
        self.shown.insert(item.to_owned(), evidence.to_owned());
        sources::write(&self.path, text(&self.shown, self.fingerprint).as_bytes())
    }

    fn report(&self, part: &Part) {
        println!("\n{}: shown with the sources of today:", part.name);
        for item in (part.items)() {
            println!("  {item:<24}{}", self.shown.get(&item).map_or("-", String::as_str));
        }
    }
}

/// A line with the fingerprint, then one per item.
fn text(shown: &BTreeMap<String, String>, fingerprint: u64) -> String {
    let lines = shown.iter().map(|(item, evidence)| format!("{item}\t{evidence}\n"));
    format!("{fingerprint:016x}\n{}", lines.collect::<String>())
}

/// Nothing if it is about other sources.
fn parse(text: &str, fingerprint: u64) -> BTreeMap<String, String> {
    let mut lines = text.lines();
    if lines.next() != Some(&format!("{fingerprint:016x}")) {
        return BTreeMap::new();
    }
    let items = lines.filter_map(|line| line.split_once('\t'));
    items.map(|(item, evidence)| (item.to_owned(), evidence.to_owned())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_record_counts_for_the_same_sources_only() {
        let shown = BTreeMap::from([("baud-rate".to_owned(), "found by a, b".to_owned())]);
        let text = text(&shown, 7);
        assert_eq!(parse(&text, 7), shown);
        assert!(parse(&text, 8).is_empty());
        assert!(parse("", 7).is_empty());
    }

    #[test]
    fn blocks_are_the_seeds_without_a_gap() {
        let blocks = blocks();
        assert_eq!(blocks[..2], ["10000..10500", "10500..11000"]);
        assert_eq!(blocks.last().map(String::as_str), Some("13500..14000"));
    }
}
