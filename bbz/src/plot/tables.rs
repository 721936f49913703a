//! The tables in which a figure finds its numbers.

use std::path::{Path, PathBuf};

use bittybuzz_toml_reader::file;

use crate::file_error::FileError;
use crate::problem::Problem;
use crate::whole_file::Inputs;

use super::files::{TableFiles, parquet_files};
use super::problem::{OtherPlace, PlotError};
use super::quantity::PlotQuantity;

/// Columns that identify a row.
pub const RUN: &str = "run";
pub const TICK: &str = "tick";
pub const ROBOT: &str = "robot";
/// The seed, and the first column after it that is no parameter.
const SEED: &str = "seed";
const FIRST_METRIC: &str = "success";

/// Columns of the table of runs that are neither parameters nor quantities.
const RUN_KEYS: [&str; 4] = [RUN, SEED, "digest", "error"];
/// Quantities of a run that stand among its parameters.
const RUN_SIZES: [&str; 2] = ["ticks", "robots"];

/// The tables of a run or a batch.
pub struct Tables {
    pub path: PathBuf,
    robots: Option<TableFiles>,
    swarm: Option<TableFiles>,
    runs: Option<TableFiles>,
}

impl Tables {
    /// Finds the tables in a folder of `--data`, or in a file of CSV.
    pub fn open(path: &Path) -> Result<Self, Box<dyn Problem>> {
        let mut tables = Tables { path: path.to_owned(), robots: None, swarm: None, runs: None };
        if path.is_dir() {
            tables.robots = TableFiles::find(path, "robots")?;
            tables.swarm = TableFiles::find(path, "swarm")?;
            tables.runs = TableFiles::find(path, "runs")?;
            if tables.all().next().is_none() {
                let files = parquet_files(path).map_err(|error| FileError::reading(path, error))?;
                let path = path.to_owned();
                return Err(match files.is_empty() {
                    true => PlotError::NoTables(path).into(),
                    false => PlotError::SingleTable(path).into(),
                });
            }
            return Ok(tables);
        }
        // The names of the columns and the rows are read one after the other, each from the beginning.
        if file::is_given_stream(path) {
            return Err(PlotError::Stream(path.to_owned()).into());
        }
        let end = path.extension().and_then(|end| end.to_str());
        if path.is_file() && matches!(end, Some("parquet" | "bbr")) {
            return Err(PlotError::OtherFile(path.to_owned()).into());
        }
        let table = TableFiles::csv(path)?;
        let place = match [RUN, TICK, ROBOT, FIRST_METRIC].map(|name| table.has(name)) {
            [true, true, true, _] => &mut tables.robots,
            [true, true, false, _] => &mut tables.swarm,
            [_, false, _, true] => &mut tables.runs,
            _ => return Err(PlotError::OtherFile(path.to_owned()).into()),
        };
        *place = Some(table);
        Ok(tables)
    }

    /// Returns the tables with another path in messages.
    pub fn named(mut self, path: &Path) -> Self {
        let tables = self.robots.iter_mut().chain(&mut self.swarm).chain(&mut self.runs);
        tables.for_each(|table| path.clone_into(&mut table.path));
        path.clone_into(&mut self.path);
        self
    }

    fn all(&self) -> impl Iterator<Item = &TableFiles> {
        self.robots.iter().chain(&self.swarm).chain(&self.runs)
    }

    /// Adds the files of the tables to those that the command reads.
    pub fn add_to(&self, inputs: &mut Inputs) {
        self.all().for_each(|table| table.add_to(inputs));
    }

    /// Returns true if there is a table of runs and no other.
    pub fn has_only_runs(&self) -> bool {
        self.robots.is_none() && self.swarm.is_none()
    }

    /// Returns the table of runs.
    pub fn runs(&self) -> Result<&TableFiles, PlotError> {
        self.runs.as_ref().ok_or_else(|| PlotError::NoRuns(self.path.clone()))
    }

    /// Returns the names of the parameters of the runs: none without a table of runs.
    pub fn parameters(&self) -> Vec<String> {
        let columns = self.runs.iter().flat_map(|table| table.columns());
        let parameters = columns.take_while(|name| *name != FIRST_METRIC).filter(|name| {
            !RUN_KEYS.contains(&name.as_str()) && !RUN_SIZES.contains(&name.as_str())
        });
        parameters.cloned().collect()
    }

    /// Returns an error unless the runs have a parameter of this name, or it is the seed or one of
    /// `others`.
    pub fn check_parameter(&self, name: &str, others: &[&str]) -> Result<(), PlotError> {
        let mut known = self.parameters();
        known.extend([SEED].iter().chain(others).map(|name| (*name).to_owned()));
        if others.contains(&name) || self.runs()?.has(name) && known.iter().any(|one| one == name) {
            return Ok(());
        }
        Err(PlotError::UnknownParameter { path: self.path.clone(), name: name.to_owned(), known })
    }

    /// Finds a quantity over time. Returns true with a quantity of robots, and false with one of the
    /// swarm.
    pub fn quantity_over_time(&self, name: &str) -> Result<(bool, PlotQuantity), PlotError> {
        let of_robots = self.robots.iter().flat_map(over_time).map(|quantity| (true, quantity));
        let of_swarm = self.swarm.iter().flat_map(over_time).map(|quantity| (false, quantity));
        let known: Vec<(bool, PlotQuantity)> = of_robots.chain(of_swarm).collect();
        if let Some(found) = known.iter().find(|(_, quantity)| quantity.is(name)) {
            return Ok(found.clone());
        }
        let place = match self.runs.iter().flat_map(of_runs).any(|quantity| quantity.is(name)) {
            true => OtherPlace::Runs,
            false => OtherPlace::Nowhere,
        };
        Err(self.unknown(name, known.into_iter().map(|(_, quantity)| quantity), place))
    }

    /// Finds a quantity of runs.
    pub fn quantity_of_runs(&self, name: &str) -> Result<PlotQuantity, PlotError> {
        let known: Vec<PlotQuantity> = of_runs(self.runs()?).collect();
        if let Some(found) = known.iter().find(|quantity| quantity.is(name)) {
            return Ok(found.clone());
        }
        let mut others = self.robots.iter().chain(&self.swarm).flat_map(over_time);
        let place = match others.any(|quantity| quantity.is(name)) {
            true => OtherPlace::Time,
            false => OtherPlace::Nowhere,
        };
        Err(self.unknown(name, known.into_iter(), place))
    }

    fn unknown(
        &self,
        name: &str,
        known: impl Iterator<Item = PlotQuantity>,
        place: OtherPlace,
    ) -> PlotError {
        PlotError::UnknownQuantity {
            path: self.path.clone(),
            name: name.to_owned(),
            known: known.map(|quantity| quantity.name).collect(),
            place,
        }
    }

    /// Returns the table of robots or that of the swarm, in which a quantity was found.
    pub fn over_time(&self, is_of_robots: bool) -> &TableFiles {
        let table = if is_of_robots { &self.robots } else { &self.swarm };
        table.as_ref().expect("a quantity was found in it")
    }
}

fn over_time(table: &TableFiles) -> impl Iterator<Item = PlotQuantity> {
    let columns =
        table.columns().iter().filter(|name| ![RUN, TICK, ROBOT].contains(&name.as_str()));
    columns.map(|name| PlotQuantity::of_column(name))
}

fn of_runs(table: &TableFiles) -> impl Iterator<Item = PlotQuantity> {
    let columns = table.columns().iter();
    let metrics = columns.clone().skip_while(|name| *name != FIRST_METRIC);
    let metrics = metrics.filter(|name| !RUN_KEYS.contains(&name.as_str()));
    let sizes = columns.filter(|name| RUN_SIZES.contains(&name.as_str()));
    metrics.chain(sizes).map(|name| PlotQuantity::of_column(name))
}
