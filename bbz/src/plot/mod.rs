//! `bbz plot`: draws the tables of runs as curves with quartiles.
//!
//! `simulated` carries out the runs of a scenario first, `tables` finds the tables and their columns, `files` reads them, `curves` and `samples` collect the
//! numbers of each curve, and the simulator's pictures draw them.

mod curves;
mod files;
mod problem;
mod quantity;
mod samples;
mod simulated;
mod tables;

use std::path::PathBuf;

use crate::exit::ExitStatus;
use crate::output;
use crate::problem::Problem;
use crate::whole_file::{self, Inputs};

use problem::PlotError;
use simulated::Simulated;
use tables::Tables;

const EXAMPLES: &str = "\
Examples:
  bbz plot swarm.toml 'mean(global.n)' --runs 30 -o n.svg    simulate 30 runs, and draw them
  bbz plot study 'mean(global.opinion)' -o opinion.svg    over time: median and quartiles of all runs
  bbz plot study x y -o places.svg                        of all robots; a panel for each quantity
  bbz plot study 'mean(global.opinion)' --by GROUP        a curve for each value of a parameter
  bbz plot study consensus --x GROUP -o times.svg         a number of each run against a parameter
  bbz plot runs.csv consensus --x GROUP --by loss         the same from the table of --csv

docs/data.md describes the tables, and the numbers that quartiles are from.";

/// Ends of the names of pictures that are no SVG.
const OTHER_PICTURES: [&str; 6] = ["png", "pdf", "jpg", "jpeg", "eps", "ps"];

/// Arguments of `bbz plot`.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct PlotArguments {
    /// Folder or file of `bbz sim --data`, table of `bbz sim --csv`, or a scenario whose runs are simulated first
    #[arg(value_name = "DIR|TABLE.csv|SCENARIO.toml")]
    tables: PathBuf,
    /// Quantities to draw, as in [output.data] or the table of runs, each in a panel
    #[arg(value_name = "QUANTITY", required = true)]
    quantities: Vec<String>,
    /// Draw numbers of runs against a parameter instead of quantities over time
    #[arg(long, value_name = "PARAMETER")]
    x: Option<String>,
    /// Draw a curve for each value of a parameter, each `run`, or each `robot`
    #[arg(long, value_name = "PARAMETER")]
    by: Option<String>,
    /// Simulate this number of runs of each combination of values of a scenario [default: that of [sweep], or 1]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    runs: Option<u32>,
    /// Values of a key of a scenario, as for `bbz sim`
    #[arg(long, value_name = "KEY=V1,V2...")]
    set: Vec<String>,
    /// Write the figure to OUT [default: standard output]
    #[arg(short, long, value_name = "OUT.svg")]
    output: Option<PathBuf>,
}

/// Carries out the command.
pub fn execute(arguments: &PlotArguments) -> Result<ExitStatus, Box<dyn Problem>> {
    let PlotArguments { quantities, x, by, output, .. } = arguments;
    if let Some(path) = output
        && let Some(end) = path.extension().and_then(|end| end.to_str())
        && OTHER_PICTURES.contains(&end)
    {
        return Err(PlotError::OtherPicture(path.clone()).into());
    }
    let simulated = match simulated::simulate(arguments)? {
        Simulated::Tables(simulated) => simulated,
        Simulated::Ended(status) => return Ok(status),
    };
    let tables = match &simulated {
        Some(simulated) => Tables::open(simulated.path())?.named(&arguments.tables),
        None => Tables::open(&arguments.tables)?,
    };
    let mut inputs = Inputs::default();
    tables.add_to(&mut inputs);
    output.iter().try_for_each(|path| inputs.refuse(path))?;
    let parameter = match x {
        Some(x) => Some(x.clone()),
        None if tables.has_only_runs() => Some(only_parameter(&tables, by.as_deref())?),
        None => None,
    };
    let figure = match parameter {
        Some(x) => curves::against(&tables, quantities, &x, by.as_deref())?,
        None => curves::over_time(&tables, quantities, by.as_deref())?,
    };
    let picture = figure.draw();
    match output {
        Some(path) => whole_file::write(path, picture.as_bytes())?,
        None => output::write(&picture)?,
    }
    Ok(simulated.map_or(ExitStatus::Success, |simulated| simulated.status))
}

/// Returns the parameter for the horizontal axis, if there is only one.
fn only_parameter(tables: &Tables, by: Option<&str>) -> Result<String, PlotError> {
    let mut known = tables.parameters();
    known.retain(|name| Some(name.as_str()) != by);
    match &known[..] {
        [one] => Ok(one.clone()),
        _ => Err(PlotError::ParameterNeeded { path: tables.path.clone(), known }),
    }
}
