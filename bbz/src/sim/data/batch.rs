//! The tables of a batch: each part of the batch has a file in the folder of each table.

use std::path::PathBuf;

use bittybuzz_arena::run::Summary;
use bittybuzz_arena::scenario::Scenario;
use bittybuzz_arena::sweep::{ParameterValue, Plan};

use crate::data::{self, PartFile, RunData};
use crate::file_error::FileError;
use crate::problem::Problem;

use super::runs::are_numbers;
use super::{RunEnd, RunTables, RunsColumns, events};

/// The table whose file is written last: it shows that a part is complete.
const LAST: &str = "runs";

/// The tables of a batch.
pub struct BatchData {
    folder: PathBuf,
    columns: RunsColumns,
}

impl BatchData {
    /// Creates the folder. A batch that goes on has files there already.
    pub fn create(
        path: &std::path::Path,
        plan: &Plan,
        scenario: &Scenario,
        goes_on: bool,
    ) -> Result<Self, Box<dyn Problem>> {
        let folder = data::batch_folder(path, goes_on)?;
        let parameters = plan.parameters.iter().enumerate().map(|(place, parameter)| {
            let values = plan.points.iter().filter_map(|point| point.get(place));
            (parameter.name.clone(), are_numbers(values))
        });
        let columns = RunsColumns::new(scenario, &parameters.collect::<Vec<_>>());
        Ok(BatchData { folder, columns })
    }

    /// Returns true if all files of a part are there.
    pub fn has_part(&self, number: usize) -> bool {
        data::part_path(&self.folder.join(LAST), number).is_file()
    }

    /// Begins the files of a part.
    pub fn part(&self, number: usize) -> PartData<'_> {
        PartData { data: self, number, files: Vec::new() }
    }
}

/// The files of a part, in memory.
pub struct PartData<'a> {
    data: &'a BatchData,
    number: usize,
    files: Vec<(&'static str, PartFile)>,
}

impl PartData<'_> {
    /// Adds the tables of a run that is complete.
    pub fn add(
        &mut self,
        mut tables: RunTables,
        point: &[ParameterValue],
        scenario: &Scenario,
        summary: &Summary,
    ) {
        let run = tables.run;
        let digest = tables.digest.expect("the run is over");
        let end = RunEnd::Complete { summary, digest };
        let mut runs = self.data.columns.table(run, summary.seed, point, scenario, end);
        let mut events = events(run, scenario, summary);
        let (robots, others) = tables.tables();
        data::sort_robots(robots);
        let others: Vec<&mut RunData> = others.collect();
        for table in [robots].into_iter().chain(others).chain([&mut events, &mut runs]) {
            self.add_table(table);
        }
    }

    /// Adds the row of a run that has ended early.
    pub fn add_failure(
        &mut self,
        (run, seed): (u32, u32),
        point: &[ParameterValue],
        scenario: &Scenario,
        error: &str,
    ) {
        let end = RunEnd::Failed(error);
        self.add_table(&mut self.data.columns.table(run, seed, point, scenario, end));
    }

    fn add_table(&mut self, table: &mut RunData) {
        let known = self.files.iter().position(|(name, _)| *name == table.name);
        let place = known.unwrap_or_else(|| {
            self.files.push((table.name, PartFile::begin(table)));
            self.files.len() - 1
        });
        self.files[place].1.add(table);
    }

    /// Writes the files, and that of the runs last.
    pub fn write(mut self) -> Result<(), FileError> {
        self.files.sort_by_key(|(name, _)| *name == LAST);
        let (folder, number) = (&self.data.folder, self.number);
        self.files.into_iter().try_for_each(|(_, file)| file.write(folder, number))
    }
}
