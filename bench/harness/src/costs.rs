//! The cost of each instruction on each chip.
//!
//! One image contains the instruction many times, together with the code that it needs; another
//! image contains only that code. The difference of their costs, divided by the number of
//! instructions, is the cost of the instruction. No cost depends on the place of the instruction.

mod cases;
mod image;
mod longest;

use crate::error::BenchError;
use crate::images::CompiledScript;
use crate::marks::ReportedMark;
use crate::program::LinkedProgram;
use crate::target::BenchTarget;
use anyhow::{Error, Result};
use bittybuzz_bench::Mark;
use bittybuzz_builds::shell::root;
use cases::CostCase;
use fs_err as fs;
use longest::{MeasuredRobot, Statement};
use std::collections::{BTreeMap, HashMap};
use std::path::Path;

/// Slots of a heap cell.
const CELL: u64 = 7;

const FILE: &str = "bench/costs.json";

/// The chips of robots.
pub const TARGETS: [BenchTarget; 5] = [
    BenchTarget::Avr,
    BenchTarget::Thumbv6m,
    BenchTarget::Thumbv7em,
    BenchTarget::Thumbv6mFull,
    BenchTarget::Thumbv7emFull,
];

/// Costs by the name of the case.
type Costs = BTreeMap<String, u64>;

/// Executes `bench costs [--update] [TARGET]`.
pub fn run(targets: &[BenchTarget], update: bool) -> Result<()> {
    let mut known = load()?;
    for target in targets {
        let costs = measure(*target)?;
        let before = known.remove(target.name()).unwrap_or_default();
        print(*target, target.name(), &costs, &before);
        known.insert(target.name().to_owned(), if update { costs } else { before });
    }
    for robot in longest::ROBOTS.iter().filter(|robot| targets.contains(&robot.target)) {
        let costs = measure_longest(robot)?;
        let before = known.remove(robot.name).unwrap_or_default();
        print(robot.target, robot.name, &costs, &before);
        known.insert(robot.name.to_owned(), if update { costs } else { before });
    }
    if update { save(&known) } else { Ok(()) }
}

/// Fails if an instruction costs more on the target, or takes longer on its robot, than the committed table allows.
pub fn check(target: BenchTarget) -> Result<Vec<String>> {
    let known = load()?;
    let mut grown = grown(target.name(), measure(target)?, &known);
    for robot in longest::ROBOTS.iter().filter(|robot| robot.target == target) {
        grown.extend(self::grown(robot.name, measure_longest(robot)?, &known));
    }
    Ok(grown)
}

/// Names each instruction that costs more than the table of that name allows.
fn grown(table: &str, now: Costs, known: &BTreeMap<String, Costs>) -> Vec<String> {
    let rows = now.into_iter().filter_map(|(name, now)| {
        let before = *known.get(table)?.get(&name)?;
        let is_more = super::figures::is_more(now, before);
        is_more.then(|| format!("{name} on {table} {before} -> {now}"))
    });
    rows.collect()
}

fn measure(target: BenchTarget) -> Result<Costs> {
    eprintln!("costs: {}", target.name());
    let mut runner = Runner::new(target)?;
    let mut costs = Costs::new();
    for case in cases::all() {
        costs.insert(case.name(), runner.cost(&case)?);
    }
    Ok(costs)
}

/// Counts the longest time of instructions on a robot.
fn measure_longest(robot: &MeasuredRobot) -> Result<Costs> {
    eprintln!("costs: {}", robot.name);
    let spec = bittybuzz_robot_files::find(robot.name)?;
    let mut runner = Runner::new(robot.target)?;
    let mut costs = Costs::new();
    for statement in &longest::STATEMENTS {
        let few = runner.longest(statement, longest::FEW_CELLS)?;
        let more = match statement.per_cell {
            0 => few,
            _ => runner.longest(statement, longest::MORE_CELLS)?,
        };
        let cells = u64::from(spec.vm.slots) / CELL;
        let per_cell = more.saturating_sub(few) / (longest::MORE_CELLS - longest::FEW_CELLS);
        let cost = few + per_cell * cells.saturating_sub(longest::FEW_CELLS);
        costs.insert(statement.name.to_owned(), cost / statement.times);
    }
    Ok(costs)
}

/// Counts images, each only once.
struct Runner {
    target: BenchTarget,
    program: LinkedProgram,
    counted: HashMap<Vec<u8>, u64>,
}

impl Runner {
    fn new(target: BenchTarget) -> Result<Runner> {
        Ok(Runner { target, program: LinkedProgram::build(target)?, counted: HashMap::new() })
    }

    /// Counts a statement with and without the instruction, on a table of this number of cells, and
    /// returns the difference.
    fn longest(&mut self, statement: &Statement, cells: u64) -> Result<u64> {
        let path = Path::new("bench/harness/src/costs/longest.rs");
        let profile = self.target.profile();
        let [with, without] = [true, false].map(|has_instruction| {
            let script = statement.script(profile, cells, has_instruction);
            self.run(CompiledScript::text(statement.name, path, script, profile)?)
        });
        let (with, without) = (with?.steps(), without?.steps());
        // A garbage collection may happen in one of the steps.
        let least =
            with.iter().zip(without).map(|(with, without)| with.saturating_sub(without)).min();
        Ok(least.unwrap_or(0))
    }

    fn cost(&mut self, case: &CostCase) -> Result<u64> {
        let CostCase { place, times, with, without, .. } = case;
        let (name, profile) = (case.name(), self.target.profile());
        let image = |write| image::image(&name, profile, *place, *times, write);
        let without = self.count(image(without)?)?;
        let with = self.count(image(with)?)?;
        let times = *times as u64;
        match with.saturating_sub(without) {
            0 => Err(failed(&name, format!("{with} with it, {without} without"))),
            all => Ok((all + times / 2) / times),
        }
    }

    fn count(&mut self, image: CompiledScript) -> Result<u64> {
        if let Some(count) = self.counted.get(&image.image) {
            return Ok(*count);
        }
        let (name, bytes) = (image.name.clone(), image.image.clone());
        let told = self.run(image)?;
        let count = told.step();
        if !told.is_steady() {
            return Err(failed(&name, format!("steps differ: {:?}", told.counts)));
        }
        self.counted.insert(bytes, count);
        Ok(count)
    }

    /// Runs an image, which must end with the expected result. A machine of many slots collects while the script
    /// goes on, so that steps would differ; the script may use all of them, and no collection happens.
    fn run(&self, image: CompiledScript) -> Result<ReportedMark> {
        let image = if self.target.has_many_slots() { image.with_all_slots() } else { image };
        let told = self.program.run(&image)?;
        if told.mark != Mark::Integer || told.value as i32 != image::EXPECTED {
            return Err(failed(&image.name, format!("{:?} {}", told.mark, told.value)));
        }
        Ok(told)
    }
}

fn failed(name: &str, reason: String) -> Error {
    BenchError::Costs { name: name.to_owned(), reason }.into()
}

fn print(target: BenchTarget, name: &str, costs: &Costs, before: &Costs) {
    println!("{name}: {}; profile {}", target.unit(), target.profile().name());
    for (name, cost) in costs {
        let before = before.get(name).map_or("new".to_owned(), u64::to_string);
        println!("{name:<48}{cost:>8}{before:>12}");
    }
    println!();
}

fn load() -> Result<BTreeMap<String, Costs>> {
    let path = root().join(FILE);
    let bytes = fs::read(&path)?;
    serde_json::from_slice(&bytes)
        .map_err(|error| BenchError::Table { path: FILE.into(), reason: error.to_string() }.into())
}

fn save(costs: &BTreeMap<String, Costs>) -> Result<()> {
    let path = root().join(FILE);
    let text = serde_json::to_string_pretty(costs).unwrap_or_default() + "\n";
    Ok(fs::write(&path, text)?)
}
