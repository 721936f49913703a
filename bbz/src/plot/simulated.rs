//! The runs of a scenario that a figure needs.

use std::path::{Path, PathBuf};

use tempfile::TempDir;

use crate::exit::ExitStatus;
use crate::file_error::FileError;
use crate::problem::Problem;
use crate::sim::{self, Tables};

use super::PlotArguments;
use super::problem::PlotError;

/// The tables of runs that were simulated for a figure.
pub struct SimulatedTables {
    /// Removed with this value.
    _folder: TempDir,
    path: PathBuf,
    pub status: ExitStatus,
}

impl SimulatedTables {
    pub fn path(&self) -> &Path {
        &self.path
    }
}

/// The tables for a figure.
pub enum Simulated {
    /// `None` if the command line names tables.
    Tables(Option<SimulatedTables>),
    /// There are none: the scenario has mistakes, or Ctrl-C came first.
    Ended(ExitStatus),
}

/// Simulates the runs of a scenario, if the command line names one.
pub fn simulate(arguments: &PlotArguments) -> Result<Simulated, Box<dyn Problem>> {
    let PlotArguments { tables: scenario, quantities, x, runs, set, output, .. } = arguments;
    let is_scenario = scenario.is_file() && scenario.extension().is_some_and(|end| end == "toml");
    if !is_scenario {
        return match runs.is_some() || !set.is_empty() {
            true => Err(PlotError::NoScenario(scenario.clone()).into()),
            false => Ok(Simulated::Tables(None)),
        };
    }
    let folder =
        tempfile::tempdir().map_err(|error| FileError::writing(Path::new("tables"), error))?;
    let (path, wanted) = match x {
        Some(_) => (folder.path().join("runs.csv"), Tables::Runs(quantities)),
        None => (folder.path().join("tables"), Tables::OverTime(quantities)),
    };
    let status = sim::write_tables(scenario, *runs, set, wanted, &path, output.as_deref())?;
    match status {
        // Runs that could not go on are reported, and the others are drawn.
        ExitStatus::Success | ExitStatus::RuntimeError => {
            Ok(Simulated::Tables(Some(SimulatedTables { _folder: folder, path, status })))
        }
        other => Ok(Simulated::Ended(other)),
    }
}
