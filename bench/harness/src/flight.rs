//! The cost of the flight controller on a Cortex-M4F, in flights of a simulated quadrotor.
//!
//! # From instructions to cycles
//! QEMU counts instructions. [`CYCLES_PER_INSTRUCTION`] is the assumption about a Cortex-M4F without
//! wait states of its flash. It comes from the mix of instructions in the cruise (QEMU's log,
//! 2026-11-25) and the cycles of the Cortex-M4's manual (ARM 100166, 3.3.1 and 7.2.3): 14 of a float
//! division (0.84 % of the instructions), 3 of a multiplication with addition (5.9 %), 2 of a load or
//! store of a float (12 %) and of other loads, 2 of a conditional and 3 of another branch, and 5 to 8
//! of several registers. The mean is 1.72.

use crate::cortex_m;
use crate::error::BenchError;
use crate::figures::is_more;
use crate::marks::MarkRecord;
use crate::report::grouped;
use anyhow::Result;
use bittybuzz_bench::Mark;
use bittybuzz_bench_flight::{
    CRUISE_FROM, CRUISE_UNTIL, FLIGHT_TICKS, FlightSensors, FlightTask, SENSORS_SYMBOL,
};
use bittybuzz_builds::chip::ChipProgram;
use bittybuzz_builds::shell::{is_installed, root, target};
use bittybuzz_emulation::ElfSymbol;
use fs_err as fs;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

const FILE: &str = "bench/flight.json";

/// Cycles of the Cortex-M4F for each instruction.
const CYCLES_PER_INSTRUCTION: f64 = 1.75;
/// Cycles of the Crazyflie's core per second.
const CLOCK_HZ: f64 = 168e6;
/// The largest share of the core that the controller may take, in percent.
const LOAD_PERCENT_MAX: f64 = 12.0;
/// The time in µs between two samples of the inertial sensors, in which all work must end.
const TICK_US_MAX: f64 = 1000.0;

/// The flights, with the names of their sensors.
const FLIGHTS: [(FlightSensors, &str); 2] =
    [(FlightSensors::Pose, "pose"), (FlightSensors::Deck, "deck")];

/// The cost of a task.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct TaskCost {
    /// Executions per second of the cruise.
    per_second: u64,
    /// Mean of the instructions in the cruise.
    mean: u64,
    /// Most instructions in the whole flight.
    most: u64,
}

/// The cost of a flight.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct FlightCost {
    /// Costs by the name of the task.
    tasks: BTreeMap<String, TaskCost>,
    /// Instructions per second of the cruise.
    per_second: u64,
    /// Most instructions in one ms of the whole flight, without those that a sample interrupts.
    most_in_ms: u64,
}

/// Costs by the name of the flight.
type FlightCosts = BTreeMap<String, FlightCost>;

/// Executes `bench flight [--update]`.
pub fn run(update: bool) -> Result<()> {
    let costs = measure()?;
    print!("{}", to_text(&costs));
    if update {
        let text = serde_json::to_string_pretty(&costs).unwrap_or_default() + "\n";
        fs::write(root().join(FILE), text)?;
    }
    Ok(())
}

/// Returns the costs that are over the budget, or have grown beyond the tolerance.
pub fn check() -> Result<Vec<String>> {
    let costs = measure()?;
    print!("{}", to_text(&costs));
    let bytes = fs::read(root().join(FILE))?;
    let before: FlightCosts = serde_json::from_slice(&bytes)
        .map_err(|error| BenchError::Table { path: FILE.into(), reason: error.to_string() })?;
    Ok(excesses(&costs, &before))
}

fn measure() -> Result<FlightCosts> {
    eprintln!("bench: flight");
    if !is_installed(cortex_m::RUNNER) {
        return Err(BenchError::Missing { program: cortex_m::RUNNER }.into());
    }
    let program =
        ChipProgram { package: "flight-cortex-m", target: "thumbv7em-none-eabihf", features: "" };
    let path = program.build(&[], true)?;
    let mut costs = FlightCosts::new();
    for (sensors, name) in FLIGHTS {
        let file = program_for(sensors, &path)?;
        let marks = cortex_m::record(cortex_m::M4F, &file, name)?;
        let cost = FlightCost::of(&marks).ok_or_else(|| BenchError::Costs {
            name: format!("the flight with {name}"),
            reason: format!("it ended with {:?}", marks.last()),
        })?;
        costs.insert(name.to_owned(), cost);
    }
    Ok(costs)
}

/// Writes the program of a flight, and returns its path.
fn program_for(sensors: FlightSensors, linked: &Path) -> Result<PathBuf> {
    let no_symbol = || BenchError::NoSymbol { program: linked.into(), symbol: SENSORS_SYMBOL };
    let mut bytes = fs::read(linked)?;
    let symbol = ElfSymbol::find(&bytes, |name| name == SENSORS_SYMBOL);
    let place = symbol.and_then(|symbol| symbol.file_range);
    *bytes.get_mut(place.ok_or_else(no_symbol)?.start).ok_or_else(no_symbol)? = sensors as u8;
    let folder = target()?.join("bench");
    fs::create_dir_all(&folder)?;
    let path = folder.join("flight");
    fs::write(&path, bytes)?;
    Ok(path)
}

impl FlightCost {
    /// Evaluates the marks of a flight; `None` if it failed or marks are missing.
    fn of(marks: &[MarkRecord]) -> Option<FlightCost> {
        let (last, pairs) = marks.split_last()?;
        if last.mark != Mark::Integer {
            return None;
        }
        let mut mark_cost = None;
        let mut tasks = BTreeMap::<FlightTask, TaskSum>::new();
        let (mut tick, mut in_ms, mut in_cruise, mut most_in_ms) = (0, 0, 0, 0);
        for pair in pairs.chunks(2) {
            let [begin, end] = pair else { return None };
            if (begin.mark, end.mark) != (Mark::Begin, Mark::End) {
                return None;
            }
            let task = FlightTask::ALL.into_iter().find(|task| *task as u32 == begin.value)?;
            let count = end.at.checked_sub(begin.at)?;
            let count = count.saturating_sub(*mark_cost.get_or_insert(count));
            if task == FlightTask::Nothing {
                continue;
            }
            let is_cruise = (CRUISE_FROM..CRUISE_UNTIL).contains(&tick);
            let sum = tasks.entry(task).or_default();
            sum.most = sum.most.max(count);
            if !task.is_elsewhere() {
                in_ms += count;
            }
            if is_cruise {
                sum.times += 1;
                sum.count += count;
                in_cruise += count;
            }
            if task == FlightTask::HandOver {
                tick += 1;
                most_in_ms = most_in_ms.max(in_ms);
                in_ms = 0;
            }
        }
        let cruise_ms = u64::from(CRUISE_UNTIL - CRUISE_FROM);
        let tasks = tasks.into_iter().map(|(task, sum)| {
            let per_second = sum.times * 1000 / cruise_ms;
            let mean = sum.count / sum.times.max(1);
            (task_name(task).to_owned(), TaskCost { per_second, mean, most: sum.most })
        });
        let per_second = in_cruise * 1000 / cruise_ms;
        (tick == FLIGHT_TICKS).then(|| FlightCost {
            tasks: tasks.collect(),
            per_second,
            most_in_ms,
        })
    }

    fn load_percent(&self) -> f64 {
        self.per_second as f64 * CYCLES_PER_INSTRUCTION / CLOCK_HZ * 100.0
    }

    fn most_us(&self) -> f64 {
        self.most_in_ms as f64 * CYCLES_PER_INSTRUCTION / CLOCK_HZ * 1e6
    }
}

/// The sum of a task's counts.
#[derive(Clone, Copy, Debug, Default)]
struct TaskSum {
    times: u64,
    count: u64,
    most: u64,
}

fn task_name(task: FlightTask) -> &'static str {
    match task {
        FlightTask::Nothing => "nothing",
        FlightTask::Tick => "tick",
        FlightTask::Pose => "pose",
        FlightTask::Flow => "flow",
        FlightTask::Range => "range",
        FlightTask::PeerReport => "report of a peer",
        FlightTask::Command => "avoidance and command",
        FlightTask::HandOver => "hand-over",
        FlightTask::Plan => "plan",
    }
}

fn excesses(costs: &FlightCosts, before: &FlightCosts) -> Vec<String> {
    let mut excesses = Vec::new();
    for (name, cost) in costs {
        let (load, most_us) = (cost.load_percent(), cost.most_us());
        if load > LOAD_PERCENT_MAX {
            excesses.push(format!("flight with {name} {load:.1} % > {LOAD_PERCENT_MAX} %"));
        }
        if most_us > TICK_US_MAX {
            excesses.push(format!("flight with {name} {most_us:.0} us > {TICK_US_MAX} us"));
        }
        let before = before.get(name).map_or(0, |before| before.per_second);
        if is_more(cost.per_second, before) {
            excesses.push(format!("flight with {name} {before} -> {}", cost.per_second));
        }
    }
    excesses
}

fn to_text(costs: &FlightCosts) -> String {
    let mut text = String::new();
    for (name, cost) in costs {
        text += &format!("flight with {name}: instructions of a Cortex-M4F, by QEMU\n");
        text += &format!("{:<24}{:>12}{:>12}{:>12}\n", "task", "per second", "mean", "most");
        for (task, TaskCost { per_second, mean, most }) in &cost.tasks {
            let (mean, most) = (grouped(*mean), grouped(*most));
            text += &format!("{task:<24}{per_second:>12}{mean:>12}{most:>12}\n");
        }
        let (load, most_us) = (cost.load_percent(), cost.most_us());
        let (all, most) = (grouped(cost.per_second), grouped(cost.most_in_ms));
        text +=
            &format!("{all} per second, {load:.1} % of the core (at most {LOAD_PERCENT_MAX})\n");
        text += &format!("{most} in one ms, {most_us:.0} us (at most {TICK_US_MAX})\n\n");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Marks of a flight whose ticks cost 100 instructions, and one of them 1000; marks cost 5.
    fn marks() -> Vec<MarkRecord> {
        let mut at = 0;
        let mut marks = Vec::new();
        let mut task = |task: FlightTask, cost: u64| {
            marks.push(MarkRecord { at, mark: Mark::Begin, value: task as u32 });
            at += cost + 5;
            marks.push(MarkRecord { at, mark: Mark::End, value: 0 });
            at += 70;
        };
        task(FlightTask::Nothing, 0);
        for tick in 0..FLIGHT_TICKS {
            if tick % 10 == 0 {
                task(FlightTask::Pose, 300);
            }
            task(FlightTask::Tick, if tick == 10 { 1000 } else { 100 });
            task(FlightTask::HandOver, 20);
            if tick == 20 {
                task(FlightTask::Plan, 5000);
            }
        }
        marks.push(MarkRecord { at, mark: Mark::Integer, value: 1 });
        marks
    }

    #[test]
    fn costs_are_those_of_the_cruise_and_the_most_of_all() {
        let cost = FlightCost::of(&marks()).unwrap();
        assert_eq!(cost.tasks["tick"], TaskCost { per_second: 1000, mean: 100, most: 1000 });
        assert_eq!(cost.tasks["pose"], TaskCost { per_second: 100, mean: 300, most: 300 });
        assert_eq!((cost.per_second, cost.most_in_ms), (150_000, 1320));
    }

    #[test]
    fn flight_that_fails_has_no_cost() {
        let mut crashed = marks();
        crashed.last_mut().unwrap().mark = Mark::Fault;
        assert_eq!(FlightCost::of(&crashed), None);
        let mut short = marks();
        // The last tick.
        short.truncate(short.len() - 5);
        short.extend(marks().pop());
        assert_eq!(FlightCost::of(&short), None);
    }

    #[test]
    fn budget_is_checked() {
        let cost = |per_second, most_in_ms| {
            let cost = FlightCost { tasks: BTreeMap::new(), per_second, most_in_ms };
            FlightCosts::from([("pose".to_owned(), cost)])
        };
        // 12 % of 168 MHz are 20.16 million cycles, and 1 ms has 168 000.
        let most = cost(11_520_000, 96_000);
        assert_eq!(excesses(&most, &most), [] as [String; 0]);
        assert_eq!(excesses(&cost(11_530_000, 0), &most).len(), 1);
        assert_eq!(excesses(&cost(11_520_000, 96_001), &most).len(), 1);
        assert_eq!(excesses(&cost(1021, 0), &cost(1000, 0)).len(), 1);
    }
}
