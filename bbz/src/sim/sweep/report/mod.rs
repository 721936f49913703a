//! `bbz sweep report`: the results of a sweep for people, as one HTML file.
//!
//! `results` has the finished runs, `classes` the values of the parameters, `estimate` the statistics,
//! `pictures` curves and maps, and `page` the file.

mod classes;
mod estimate;
mod page;
mod pictures;
mod results;

use std::path::PathBuf;

use bittybuzz_arena::output::metrics::Metric;
use clap::Args;

use crate::chunks::{self, StoreProblem};
use crate::exit::ExitStatus;
use crate::output;
use crate::problem::Problem;
use crate::whole_file;

use super::super::experiment;
use super::folder;
use classes::Classes;
use page::{Report, RunLink};
use results::Results;

/// The first metric of a scenario's own quantities, and the first after them.
const OWN: usize = 2;
const FIRST_COUNT: &str = "sent";

/// The most parameters that have pictures unless they are chosen.
const PARAMETERS: usize = 4;

/// The most metrics that are in a report unless they are chosen.
const METRICS: usize = 20;

/// A name on the command line that nothing has.
#[derive(Debug, thiserror::Error)]
#[error("the sweep has no {what} `{name}`")]
struct Unknown {
    what: &'static str,
    name: String,
    known: Vec<String>,
}

impl Problem for Unknown {
    fn help(&self) -> Option<String> {
        Some(match self.known.is_empty() {
            true => format!("it has no {}s", self.what),
            false => format!("it has {}", self.known.join(", ")),
        })
    }
}

/// Arguments of `bbz sweep report`.
#[derive(Debug, Args)]
pub struct ReportArguments {
    /// Folder of `bbz sweep plan`
    folder: PathBuf,
    /// Report only this metric; may be given several times [default: the scenario's own that differ between runs]
    #[arg(long, value_name = "METRIC")]
    metric: Vec<String>,
    /// Draw only this parameter; may be given several times [default: the first four that vary]
    #[arg(long, value_name = "PARAMETER")]
    parameter: Vec<String>,
    /// Write the report to a file [default: standard output]
    #[arg(short, long, value_name = "OUT.html")]
    output: Option<PathBuf>,
    /// Show the report in the browser, where links open the runs
    #[cfg(feature = "view")]
    #[arg(long, conflicts_with = "output")]
    view: bool,
    /// Print the address of the report and open no browser
    #[cfg(feature = "view")]
    #[arg(long, requires = "view")]
    no_browser: bool,
}

/// Carries out the command.
pub fn execute(arguments: &ReportArguments) -> Result<ExitStatus, Box<dyn Problem>> {
    let store = folder::open(&arguments.folder)?;
    if let Some(path) = &arguments.output {
        folder::refuse(path, &arguments.folder, store.plan())?;
    }
    let sim = folder::arguments(&arguments.folder, store.plan());
    let Some(study) = folder::shown_study(&sim, &store)? else {
        return Ok(ExitStatus::CompileError);
    };
    let runs = experiment::runs(store.plan());
    let found = store.all(|run| runs.key(run)).map_err(StoreProblem)?;
    chunks::print_aside(&found.aside);
    let results = Results::new(&study, found.outcomes);
    let metrics = metrics(&results, &arguments.metric)?;
    let (parameters, pooled) = parameters(&results, &arguments.parameter)?;
    let report = Report {
        results: &results,
        metrics: &metrics,
        parameters: &parameters,
        pooled: &pooled,
        planned: runs.count(),
        program: &store.plan().experiment.program,
        link: RunLink::Command(&arguments.folder),
    };
    #[cfg(feature = "view")]
    if arguments.view {
        let report = Report { link: RunLink::Served, ..report };
        return super::view::serve(report.to_html(), &study, arguments.no_browser);
    }
    match &arguments.output {
        Some(path) => whole_file::write(path, report.to_html().as_bytes())?,
        None => output::write(&report.to_html())?,
    }
    Ok(ExitStatus::Success)
}

/// Returns the places of the metrics of a report.
fn metrics(results: &Results, names: &[String]) -> Result<Vec<usize>, Unknown> {
    let all = &results.study.metrics;
    if names.is_empty() {
        let counts = all.iter().position(|metric| metric.name == FIRST_COUNT);
        let is_own = |place: &usize| (OWN..counts.unwrap_or(all.len())).contains(place);
        return Ok(results.varying().into_iter().filter(is_own).take(METRICS).collect());
    }
    let place = |name: &String| {
        all.iter().position(|metric| metric.name == *name).ok_or_else(|| Unknown {
            what: "metric",
            name: name.clone(),
            known: all.iter().map(|Metric { name, .. }| name.clone()).collect(),
        })
    };
    names.iter().map(place).collect()
}

/// Returns the parameters of the pictures, and the names of those that vary without being in one.
fn parameters(results: &Results, names: &[String]) -> Result<(Vec<Classes>, Vec<String>), Unknown> {
    let plan = &results.study.runs.plan;
    let known: Vec<String> = plan.parameters.iter().map(|one| one.name.clone()).collect();
    if let Some(name) = names.iter().find(|name| !known.contains(name)) {
        return Err(Unknown { what: "parameter", name: name.clone(), known });
    }
    let (mut shown, mut pooled) = (Vec::new(), Vec::new());
    for (place, name) in known.iter().enumerate() {
        let varies = plan.points.iter().any(|point| point[place] != plan.points[0][place]);
        let is_chosen = match names.is_empty() {
            true => shown.len() < PARAMETERS,
            false => names.contains(name),
        };
        match Classes::of(plan, place).filter(|_| is_chosen) {
            Some(classes) => shown.push(classes),
            None if varies => pooled.push(name.clone()),
            None => {}
        }
    }
    Ok((shown, pooled))
}
