//! The tables of runs for [`crate::data`].

mod batch;
mod quantity;
mod runs;
mod seen;
mod single;

use std::iter;

use bittybuzz_arena::run::{
    JoinedRobot, Observer, RunWatcher, Setup, Simulation, Summary, TICKS_PER_SECOND,
};
use bittybuzz_arena::scenario::{DataSection, Quantity, Scenario};
use bittybuzz_tables::Cells;

use crate::data::{Cell, RunData, count, integer, text};

use quantity::QuantityColumn;
use runs::{RunEnd, RunsColumns};
use seen::Seen;

pub use batch::{BatchData, PartData};
pub use single::SingleData;

/// Returns the quantities that a scenario chooses, or the usual ones.
pub fn quantities(scenario: &Scenario) -> Vec<Quantity> {
    match &scenario.output.data.quantities {
        Some(named) => named.iter().map(|(quantity, _)| quantity.clone()).collect(),
        None => DataSection::USUAL.to_vec(),
    }
}

/// The tables of a run, whose rows wait in memory.
pub struct RunTables {
    run: u32,
    /// Ticks between two samples.
    every: u64,
    robot_columns: Vec<QuantityColumn>,
    swarm_columns: Vec<QuantityColumn>,
    robots: RunData,
    /// `None` if no quantity is one of the swarm.
    swarm: Option<RunData>,
    seen: Seen,
    /// The digest at the end of the run.
    digest: Option<u64>,
}

impl RunTables {
    /// Returns the digest of the world at the end of the run, or `None` before.
    pub fn digest(&self) -> Option<u64> {
        self.digest
    }

    /// Returns the tables of the run with that number, without rows.
    pub fn new(run: u32, setup: &Setup) -> Self {
        let data = &setup.scenario.output.data;
        let mut robot_columns: Vec<QuantityColumn> = Vec::new();
        let mut swarm_columns: Vec<QuantityColumn> = Vec::new();
        for quantity in quantities(&setup.scenario) {
            let probe = setup.probe(&quantity).expect("the setup has resolved all quantities");
            let columns = match quantity.is_of_swarm() {
                true => &mut swarm_columns,
                false => &mut robot_columns,
            };
            let column = QuantityColumn::new(&quantity, probe);
            if columns.iter().all(|known| known.name != column.name) {
                columns.push(column);
            }
        }
        let columns = |first: &[&str], others: &[QuantityColumn]| {
            let first = first.iter().map(|name| integer(name));
            first.chain(others.iter().map(QuantityColumn::column)).collect()
        };
        let robots = RunData::new("robots", columns(&["run", "tick", "robot"], &robot_columns));
        let swarm = (!swarm_columns.is_empty())
            .then(|| RunData::new("swarm", columns(&["run", "tick"], &swarm_columns)));
        let every = (data.every * TICKS_PER_SECOND).round().max(1.0) as u64;
        let seen = Seen::new(data.messages);
        RunTables { run, every, robot_columns, swarm_columns, robots, swarm, seen, digest: None }
    }

    /// Returns the number of rows that wait.
    fn rows(&self) -> usize {
        self.robots.rows() + self.seen.rows()
    }

    /// Returns the table of robots, and the others.
    fn tables(&mut self) -> (&mut RunData, impl Iterator<Item = &mut RunData>) {
        (&mut self.robots, self.swarm.iter_mut().chain(self.seen.tables()))
    }

    fn add_sample(&mut self, simulation: &Simulation) {
        let [run, tick] = [u64::from(self.run), simulation.now()].map(count);
        let setup = simulation.setup();
        // A robot that has not joined has no state.
        let robots: Vec<JoinedRobot<'_>> = simulation.joined().collect();
        let [Cells::Integers(runs), Cells::Integers(ticks), Cells::Integers(ids), columns @ ..] =
            self.robots.cells()
        else {
            unreachable!("the table has these three columns, which are integers")
        };
        runs.extend(iter::repeat_n(run, robots.len()));
        ticks.extend(iter::repeat_n(tick, robots.len()));
        ids.extend(robots.iter().map(|robot| count(setup.id(robot.number).into())));
        for (column, cells) in self.robot_columns.iter().zip(columns) {
            // A text, a table and a function are no numbers.
            let number = |robot| simulation.read_joined(&column.probe, robot).number();
            column.extend(cells, robots.iter().map(number));
        }
        if let Some(swarm) = &mut self.swarm {
            let measures = self.swarm_columns.iter();
            let measures = measures.map(|column| {
                column.cell(simulation.numbers(&column.probe).first().copied().flatten())
            });
            swarm.push([run, tick].map(Cell::Integer).into_iter().chain(measures));
        }
    }
}

impl RunWatcher for RunTables {
    fn observer(&mut self) -> Option<&mut dyn Observer> {
        Some(&mut self.seen)
    }

    /// Adds a row for each robot, if a sample is due.
    fn read(&mut self, simulation: &Simulation) {
        if simulation.now().is_multiple_of(self.every) {
            self.add_sample(simulation);
        }
        self.seen.resolve(self.run, simulation);
        if simulation.is_over() {
            self.digest = Some(simulation.digest());
        }
    }
}

/// Returns the table of the events of the scenario that have happened.
fn events(run: u32, scenario: &Scenario, summary: &Summary) -> RunData {
    let columns = vec![integer("run"), integer("tick"), integer("event"), text("action")];
    let mut table = RunData::new("events", columns);
    for (event, scheduled) in scenario.events.iter().enumerate() {
        let tick = (scheduled.at * TICKS_PER_SECOND).round() as u64;
        if tick >= summary.ticks {
            continue;
        }
        let action = Some(scheduled.action.key().to_owned());
        let numbers = [u64::from(run), tick, event as u64].map(|value| Cell::Integer(count(value)));
        table.push(numbers.into_iter().chain([Cell::OptionalText(action)]));
    }
    table
}
