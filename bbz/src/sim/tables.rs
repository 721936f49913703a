//! Tables of the runs of a scenario for another command.

use std::path::{Path, PathBuf};

use bittybuzz_arena::output::metrics;
use bittybuzz_arena::sweep::Axis;

use crate::exit::ExitStatus;
use crate::problem::Problem;

use super::arguments::SimArguments;
use super::{batch, plan, source};

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
/// progress and errors alone. `output` is a file that the caller will write, which must be none that the
/// runs read.
pub fn write_tables(
    scenario: &Path,
    runs: Option<u32>,
    set: &[String],
    tables: Tables<'_>,
    path: &Path,
    output: Option<&Path>,
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
    batch::complete(&sim, axes, output).map(|(status, _)| status)
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
