//! The tables of a single run, which are written while it goes on.

use std::path::Path;

use bittybuzz_arena::run::{Observer, RunWatcher, Setup, Simulation, Summary};

use crate::data::DataFiles;
use crate::problem::Problem;
use crate::whole_file::Inputs;

use super::seen::Seen;
use super::{RunEnd, RunTables, RunsColumns, events};

/// The number of the run.
const RUN: u32 = 0;

/// The tables of a single run, and their files.
pub struct SingleData {
    tables: RunTables,
    files: DataFiles,
}

impl SingleData {
    /// Creates the destination, which must not be an input.
    pub fn create(path: &Path, setup: &Setup, inputs: &Inputs) -> Result<Self, Box<dyn Problem>> {
        let mut tables = RunTables::new(RUN, setup);
        let files = DataFiles::create(path, &tables.robots, inputs)?;
        if !files.has_all_tables() {
            // Observing frames takes many times longer than the rest of a tick.
            tables.seen = Seen::new(false);
        }
        Ok(SingleData { tables, files })
    }

    /// Returns the observer of the run.
    pub fn observer(&mut self) -> &mut dyn Observer {
        &mut self.tables.seen
    }

    /// Adds the rows that are due, and writes those that have waited for long.
    pub fn read(&mut self, simulation: &Simulation) -> Result<(), Box<dyn Problem>> {
        self.tables.read(simulation);
        if !self.files.is_due(self.tables.rows()) {
            return Ok(());
        }
        let (robots, others) = self.tables.tables();
        self.files.take(robots, others, false)
    }

    /// Writes all rows, and the tables of the events and of the run itself.
    pub fn finish(
        mut self,
        setup: &Setup,
        summary: &Summary,
        digest: u64,
    ) -> Result<(), Box<dyn Problem>> {
        let columns = RunsColumns::new(&setup.scenario, &[]);
        let end = RunEnd::Complete { summary, digest };
        let runs = columns.table(RUN, summary.seed, &[], &setup.scenario, end);
        let mut ends = [events(RUN, &setup.scenario, summary), runs];
        let (robots, others) = self.tables.tables();
        self.files.take(robots, others.chain(&mut ends), true)
    }
}
