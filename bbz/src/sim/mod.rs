//! `bbz sim`: simulates the robots of a scenario.

mod arguments;
mod batch;
mod checks;
mod data;
pub mod desk;
mod doors;
mod experiment;
mod journal;
mod live;
mod open;
mod plan;
mod programs;
mod progress;
mod recorder;
mod runs;
mod source;
mod stops;
mod study;
pub mod summary;
pub mod sweep;
mod table;
#[cfg(feature = "view")]
mod unsaved;
#[cfg(feature = "view")]
mod values;
#[cfg(feature = "view")]
mod view;
mod work;

use std::path::{Path, PathBuf};

use bittybuzz_arena::output::metrics;
use bittybuzz_arena::sweep::Axis;

use crate::exit::ExitStatus;
use crate::problem::Problem;

use arguments::SEED;
pub use arguments::SimArguments;

/// Options that contradict each other.
#[derive(Debug, thiserror::Error)]
enum OptionsError {
    #[error("`--seed` and `--set world.seed` both give the seed")]
    TwoSeeds,
    #[error("`--checks` reports one run, and `--set` asks for several")]
    ChecksOfMany,
    #[cfg(feature = "view")]
    #[error("`--view` shows one run, and `--set` asks for several")]
    ViewOfMany,
}

impl Problem for OptionsError {
    fn help(&self) -> Option<String> {
        let help = match self {
            OptionsError::TwoSeeds => "leave out one of them",
            OptionsError::ChecksOfMany => "give each key of `--set` one value",
            #[cfg(feature = "view")]
            OptionsError::ViewOfMany => "give each key of `--set` one value",
        };
        Some(help.to_owned())
    }
}

/// Carries out the command.
pub fn execute(arguments: &SimArguments) -> Result<ExitStatus, Box<dyn Problem>> {
    let axes = plan::axes(&arguments.set)?;
    check_seed(arguments, &axes)?;
    let is_single = axes.iter().all(|axis| axis.rows.len() == 1);
    let only = plan::first_settings(&axes);
    match is_single {
        #[cfg(feature = "view")]
        true if arguments.view => view::run(arguments, &only),
        true if arguments.runs.is_none() && arguments.csv.is_none() => live::run(arguments, &only),
        #[cfg(feature = "view")]
        _ if arguments.view => Err(OptionsError::ViewOfMany.into()),
        _ if arguments.checks => Err(OptionsError::ChecksOfMany.into()),
        _ => batch::run(arguments, axes),
    }
}

/// A name that no metric of a scenario has.
#[derive(Debug, thiserror::Error)]
#[error("the runs of `{path}` have no number `{name}`")]
struct UnknownMetric {
    path: PathBuf,
    name: String,
    known: Vec<String>,
}

impl Problem for UnknownMetric {
    fn help(&self) -> Option<String> {
        let known: Vec<String> = self.known.iter().map(|name| format!("`{name}`")).collect();
        Some(format!("they have {}", known.join(", ")))
    }
}

/// The tables that a figure needs.
pub enum Tables<'a> {
    /// Those of `--data`, with these quantities.
    OverTime(&'a [String]),
    /// That of `--csv`, with these metrics.
    Runs(&'a [String]),
}

/// Simulates many runs of a scenario, and writes their tables to a path that does not exist. Prints
/// progress and errors alone.
pub fn write_tables(
    scenario: &Path,
    runs: Option<u32>,
    set: &[String],
    tables: Tables<'_>,
    path: &Path,
) -> Result<ExitStatus, Box<dyn Problem>> {
    let mut sim = SimArguments::of_sweep(scenario.to_owned(), Vec::new(), None);
    (sim.runs, sim.set) = (runs, set.to_owned());
    match tables {
        Tables::OverTime(quantities) => {
            let quoted = quantities.iter().map(|quantity| toml_string(quantity));
            let list = quoted.collect::<Vec<String>>().join(",");
            sim.set.push(format!("output.data.quantities=[{list}]"));
            sim.data = Some(path.to_owned());
        }
        Tables::Runs(_) => sim.csv = Some(path.to_owned()),
    }
    let axes = plan::axes(&sim.set)?;
    if let Tables::Runs(metrics) = tables {
        check_metrics(&sim, &axes, metrics)?;
    }
    batch::complete(&sim, axes).map(|(status, _)| status)
}

/// Refuses names that no metric of a scenario has, before its runs take their time.
fn check_metrics(
    sim: &SimArguments,
    axes: &[Axis],
    names: &[String],
) -> Result<(), Box<dyn Problem>> {
    let text = source::read(sim)?;
    // Mistakes of the scenario are reported with its runs.
    let Ok(scenario) = source::parse(&text.path, &text.text, &plan::first_settings(axes)) else {
        return Ok(());
    };
    let known = metrics::metrics(&scenario);
    let unknown = names.iter().find(|name| known.iter().all(|metric| metric.name != **name));
    match unknown {
        Some(name) => {
            let known = known.into_iter().map(|metric| metric.name).collect();
            Err(UnknownMetric { path: sim.scenario.clone(), name: name.clone(), known }.into())
        }
        None => Ok(()),
    }
}

/// Returns a text as a TOML string.
fn toml_string(text: &str) -> String {
    let plain = text.replace('\\', "\\\\").replace('"', "\\\"");
    format!("\"{plain}\"")
}

/// Refuses a seed that two options give.
fn check_seed(arguments: &SimArguments, axes: &[Axis]) -> Result<(), OptionsError> {
    let mut keys = axes.iter().flat_map(|axis| &axis.keys);
    match arguments.seed.is_some() && keys.any(|key| key == SEED) {
        true => Err(OptionsError::TwoSeeds),
        false => Ok(()),
    }
}
