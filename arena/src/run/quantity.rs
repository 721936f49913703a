//! Quantities of a run. The names in the scenario are resolved once; then values are read from
//! robots.

use bittybuzz_vm_core::builtin;

use crate::engine::{RobotState, RobotView};
use crate::scenario::{
    AggregateRule, Filter, GroundArea, Group, Key, Quantity, ScenarioCause, Selection, Swarm, Test,
    groups_of,
};

use super::program::{LoadedProgram, Program};
use super::tick_at;
use crate::robot::{ProgramId, SimRobot, VariableContent};

/// The value of a robot's quantity at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum QuantityReading<'p> {
    /// nil, or the robot has not joined.
    Nil,
    /// A number.
    Number(f64),
    /// A string of the script.
    Text(&'p str),
    /// A table, a function, or a string that the script does not contain.
    Other,
}

/// A quantity whose names are resolved ([`Setup::probe`](super::Setup::probe)). A probe is valid for
/// all runs of its setup; it reads nil in programs that commands load later.
#[derive(Debug, Clone, PartialEq)]
pub enum QuantityProbe {
    /// A quantity of the body or of the state of the script.
    Body(Quantity),
    /// The global's number in each program, and the keys into tables there; `None` for a program
    /// without one of these names.
    Global(Vec<Option<(u16, Vec<VariableContent>)>>),
    /// A measure of all robots together.
    Swarm(Swarm),
    /// A stigmergy's entry: its number, and the key in each program.
    Stigmergy(u16, Vec<Option<VariableContent>>),
    /// The distance to the place at a tick, or to the place of the start.
    Displacement(Option<u64>),
    /// One number from the values of several robots.
    Aggregate(Box<AggregateProbe>),
}

/// An aggregate whose names are resolved.
#[derive(Debug, Clone, PartialEq)]
pub struct AggregateProbe {
    pub(super) rule: AggregateRule,
    pub(super) value: QuantityProbe,
    /// The condition of the robots that count.
    pub(super) among: Option<(QuantityProbe, Test)>,
}

impl QuantityProbe {
    /// Resolves names in the programs of `robots`. At least one of the programs must have them.
    pub(super) fn new(
        quantity: &Quantity,
        groups: &[Group],
        programs: &[LoadedProgram],
        robots: &Selection,
    ) -> Result<QuantityProbe, ScenarioCause> {
        match quantity {
            Quantity::Global { name, keys } => {
                let numbers: Vec<_> =
                    programs.iter().map(|loaded| path(&loaded.program, name, keys)).collect();
                let of_robots = groups_of(groups, robots);
                // The groups are in ascending order.
                let is_meant =
                    |loaded: &LoadedProgram| of_robots.binary_search(&loaded.group).is_ok();
                let mut with_numbers = programs.iter().zip(&numbers);
                if with_numbers.any(|(loaded, number)| is_meant(loaded) && number.is_some()) {
                    return Ok(QuantityProbe::Global(numbers));
                }
                let programs = programs.iter().filter(|loaded| is_meant(loaded));
                let known = programs.flat_map(|loaded| loaded.program.globals());
                // Names with a blank are internal to the compiler.
                let mut known: Vec<String> =
                    known.filter(|name| !name.contains(' ')).cloned().collect();
                known.sort();
                known.dedup();
                Err(ScenarioCause::UnknownGlobal { name: unknown(name, keys, &known), known })
            }
            Quantity::Stigmergy { number, key } => {
                let keys = programs.iter().map(|loaded| content(&loaded.program, key));
                Ok(QuantityProbe::Stigmergy(*number, keys.collect()))
            }
            Quantity::Swarm(of) => Ok(QuantityProbe::Swarm(*of)),
            Quantity::Displacement(time) => Ok(QuantityProbe::Displacement(time.map(tick_at))),
            Quantity::Aggregate(of) => {
                let probe = |part| QuantityProbe::new(part, groups, programs, robots);
                let among = match &of.among {
                    Some(Filter { value, test }) => Some((probe(value)?, test.clone())),
                    None => None,
                };
                let (rule, value) = (of.rule.clone(), probe(&of.value)?);
                Ok(QuantityProbe::Aggregate(Box::new(AggregateProbe { rule, value, among })))
            }
            body => Ok(QuantityProbe::Body(body.clone())),
        }
    }

    /// Resolves the names of the quantity in one more program.
    pub(super) fn learn(&mut self, quantity: &Quantity, program: &Program) {
        match (self, quantity) {
            (QuantityProbe::Global(numbers), Quantity::Global { name, keys }) => {
                numbers.push(path(program, name, keys));
            }
            (QuantityProbe::Stigmergy(_, keys), Quantity::Stigmergy { key, .. }) => {
                keys.push(content(program, key));
            }
            (QuantityProbe::Aggregate(probe), Quantity::Aggregate(of)) => {
                probe.value.learn(&of.value, program);
                if let (Some((probe, _)), Some(filter)) = (&mut probe.among, &of.among) {
                    probe.learn(&filter.value, program);
                }
            }
            _ => {}
        }
    }

    /// Reads the quantity from a robot with that program.
    pub(super) fn read<'p>(
        &self,
        ProgramId(number): ProgramId,
        program: &'p Program,
        robot: &SimRobot,
        view: &RobotView,
    ) -> QuantityReading<'p> {
        match self {
            QuantityProbe::Body(quantity) => body(quantity, robot, view),
            // A single robot has no such quantity.
            QuantityProbe::Swarm(_) | QuantityProbe::Aggregate(_) => QuantityReading::Nil,
            QuantityProbe::Displacement(_) => unreachable!("the simulation reads places"),
            // A caller may have made the probe before a command loaded the program.
            QuantityProbe::Global(numbers) => match numbers.get(number) {
                Some(Some((global, keys))) => reading(robot.global(*global, keys), program),
                _ => QuantityReading::Nil,
            },
            QuantityProbe::Stigmergy(stigmergy, keys) => match keys.get(number) {
                Some(Some(key)) => reading(robot.stigmergy(*stigmergy, *key), program),
                _ => QuantityReading::Nil,
            },
        }
    }
}

/// Returns the name that no script has: the name of the global, or, if a script has the global, the
/// name with the keys.
fn unknown(name: &str, keys: &[Key], known: &[String]) -> String {
    match known.iter().any(|global| global == name) {
        true => Quantity::Global { name: name.to_owned(), keys: keys.to_vec() }
            .to_string()
            .replacen("global.", "", 1),
        false => name.to_owned(),
    }
}

/// Returns the number of a global and the keys into tables there; `None` if the script lacks one of
/// the names.
fn path(program: &Program, name: &str, keys: &[Key]) -> Option<(u16, Vec<VariableContent>)> {
    let keys = keys.iter().map(|key| content(program, key));
    Some((program.global(name)?, keys.collect::<Option<Vec<VariableContent>>>()?))
}

/// Returns a key as it is in the script; `None` for a string that the script does not contain.
fn content(program: &Program, key: &Key) -> Option<VariableContent> {
    match key {
        Key::Number(key) => Some(VariableContent::Number(f64::from(*key))),
        Key::Text(text) => string_number(program, text).map(VariableContent::Text),
    }
}

/// Returns the number of a string of the script.
fn string_number(program: &Program, text: &str) -> Option<u16> {
    let symbols = program.symbols.as_ref()?;
    let own = symbols.strings.iter().position(|string| string == text);
    let number = match own {
        Some(own) => own + usize::from(builtin::string::COUNT),
        None => builtin::STRINGS.iter().position(|string| *string == text)?,
    };
    // Symbols may come from a file, so that their number has no limit. A machine has no such string.
    u16::try_from(number).ok()
}

fn reading(content: VariableContent, program: &Program) -> QuantityReading<'_> {
    match content {
        VariableContent::Nil => QuantityReading::Nil,
        VariableContent::Number(number) => QuantityReading::Number(number),
        VariableContent::Text(number) => {
            program.string(number).map_or(QuantityReading::Other, QuantityReading::Text)
        }
        VariableContent::Other => QuantityReading::Other,
    }
}

fn body<'p>(quantity: &Quantity, robot: &SimRobot, view: &RobotView) -> QuantityReading<'p> {
    let pose = view.pose;
    let (x, y) = (f64::from(pose.x), f64::from(pose.y));
    QuantityReading::Number(match quantity {
        Quantity::X => x,
        Quantity::Y => y,
        Quantity::Z => f64::from(pose.z),
        Quantity::Heading => f64::from(pose.heading).to_degrees(),
        Quantity::Distance([to_x, to_y]) => libm::hypot(x - to_x, y - to_y),
        Quantity::Inside(area) => f64::from(u8::from(contains(*area, [x, y]))),
        Quantity::Led => f64::from(view.led),
        Quantity::Neighbors => robot.neighbors() as f64,
        Quantity::Free => robot.free_slots() as f64,
        Quantity::Steps => f64::from(robot.state().steps),
        Quantity::Faults => robot.state().fault_counts().faults as f64,
        Quantity::Restarts => robot.state().fault_counts().restarts as f64,
        Quantity::HandlerFaults => robot.state().fault_counts().handler_faults as f64,
        Quantity::Overruns => robot.state().missed_steps() as f64,
        Quantity::Crashes => f64::from(view.crashes),
        Quantity::Running => {
            let runs = view.state == RobotState::Running && !robot.state().is_faulted();
            f64::from(u8::from(runs))
        }
        Quantity::Global { .. }
        | Quantity::Stigmergy { .. }
        | Quantity::Displacement(_)
        | Quantity::Swarm(_)
        | Quantity::Aggregate(_) => {
            unreachable!("other variants of `QuantityProbe` read these")
        }
    })
}

fn contains(area: GroundArea, [x, y]: [f64; 2]) -> bool {
    match area {
        GroundArea::Disc { at, radius } => libm::hypot(x - at[0], y - at[1]) <= radius,
        GroundArea::Box { at, size } => {
            (x - at[0]).abs() <= size[0] / 2.0 && (y - at[1]).abs() <= size[1] / 2.0
        }
    }
}

impl QuantityReading<'_> {
    /// Returns the number, if the reading is one.
    pub fn number(&self) -> Option<f64> {
        match self {
            QuantityReading::Number(number) => Some(*number),
            _ => None,
        }
    }

    /// Returns true if two readings have the same value. Numbers may differ by `tolerance`. nil
    /// equals nothing.
    pub fn is_like(&self, other: &QuantityReading<'_>, tolerance: f64) -> bool {
        match (self, other) {
            (QuantityReading::Number(one), QuantityReading::Number(other)) => {
                (one - other).abs() <= tolerance
            }
            (QuantityReading::Text(one), QuantityReading::Text(other)) => one == other,
            _ => false,
        }
    }
}
