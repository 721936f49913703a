//! What each instruction costs on each chip.
//!
//! An image in which the instruction stands many times, beside what it needs, takes longer than one with only what it
//! needs; the difference, divided by how many there are, is its cost. No cost depends on the place of the instruction.

mod cases;
mod image;

use super::error::BenchError;
use super::images::Compiled;
use super::program::Program;
use super::target::Target;
use crate::failure::Failure;
use crate::shell::root;
use bittybuzz_bench::Mark;
use cases::Case;
use std::collections::{BTreeMap, HashMap};
use std::fs;

const FILE: &str = "bench/costs.json";

/// The chips of robots.
pub const TARGETS: [Target; 5] =
    [Target::Avr, Target::Thumbv6m, Target::Thumbv7em, Target::Thumbv6mFull, Target::Thumbv7emFull];

/// By case.
type Costs = BTreeMap<String, u64>;

/// `bench costs [--update] [TARGET]`
pub fn run(targets: &[Target], update: bool) -> Result<(), Failure> {
    let mut known = load()?;
    for target in targets {
        let costs = measure(*target)?;
        let before = known.remove(target.name()).unwrap_or_default();
        print(*target, &costs, &before);
        known.insert(target.name().to_owned(), if update { costs } else { before });
    }
    if update { save(&known) } else { Ok(()) }
}

/// Fails if an instruction costs more on the target than the committed table allows.
pub fn check(target: Target) -> Result<Vec<String>, Failure> {
    let before = load()?.remove(target.name()).unwrap_or_default();
    let now = measure(target)?;
    let rows = now.into_iter().filter_map(|(name, now)| {
        let before = *before.get(&name)?;
        let is_more = super::figures::is_more(now, before);
        is_more.then(|| format!("{name} on {} {before} -> {now}", target.name()))
    });
    Ok(rows.collect())
}

fn measure(target: Target) -> Result<Costs, Failure> {
    eprintln!("costs: {}", target.name());
    let mut runner = Runner { target, program: Program::build(target)?, counted: HashMap::new() };
    let mut costs = Costs::new();
    for case in cases::all() {
        costs.insert(case.name(), runner.cost(&case)?);
    }
    Ok(costs)
}

/// Counts images, none twice.
struct Runner {
    target: Target,
    program: Program,
    counted: HashMap<Vec<u8>, u64>,
}

impl Runner {
    fn cost(&mut self, case: &Case) -> Result<u64, Failure> {
        let Case { place, times, with, without, .. } = case;
        let (name, profile) = (case.name(), self.target.profile());
        let image = |write| image::image(&name, profile, *place, *times, write);
        let without = self.count(&image(without).map_err(Failure::Bench)?)?;
        let with = self.count(&image(with).map_err(Failure::Bench)?)?;
        let times = *times as u64;
        match with.saturating_sub(without) {
            0 => Err(failed(&name, format!("{with} with it, {without} without"))),
            all => Ok((all + times / 2) / times),
        }
    }

    fn count(&mut self, image: &Compiled) -> Result<u64, Failure> {
        if let Some(count) = self.counted.get(&image.image) {
            return Ok(*count);
        }
        let told = self.program.run(image)?;
        if told.mark != Mark::Integer || told.value as i32 != image::EXPECTED {
            return Err(failed(&image.name, format!("{:?} {}", told.mark, told.value)));
        }
        let count = told.step();
        if !told.is_steady() {
            return Err(failed(&image.name, format!("steps differ: {:?}", told.counts)));
        }
        self.counted.insert(image.image.clone(), count);
        Ok(count)
    }
}

fn failed(name: &str, reason: String) -> Failure {
    Failure::Bench(BenchError::Costs { name: name.to_owned(), reason })
}

fn print(target: Target, costs: &Costs, before: &Costs) {
    println!("{}: {}; profile {}", target.name(), target.unit(), target.profile().name());
    for (name, cost) in costs {
        let before = before.get(name).map_or("new".to_owned(), u64::to_string);
        println!("{name:<48}{cost:>8}{before:>12}");
    }
    println!();
}

fn load() -> Result<BTreeMap<String, Costs>, Failure> {
    let path = root().join(FILE);
    let bytes = fs::read(&path).map_err(|reason| Failure::Read { path, reason })?;
    serde_json::from_slice(&bytes).map_err(|error| {
        Failure::Bench(BenchError::Table { path: FILE.into(), reason: error.to_string() })
    })
}

fn save(costs: &BTreeMap<String, Costs>) -> Result<(), Failure> {
    let path = root().join(FILE);
    let text = serde_json::to_string_pretty(costs).unwrap_or_default() + "\n";
    fs::write(&path, text).map_err(|reason| Failure::Write { path, reason })
}
