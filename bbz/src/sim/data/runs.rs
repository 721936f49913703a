//! The table of runs: parameters, seed, metrics, digest and error of each.

use std::collections::BTreeSet;

use bittybuzz_arena::output::metrics;
use bittybuzz_arena::run::Summary;
use bittybuzz_arena::scenario::Scenario;
use bittybuzz_arena::sweep::ParameterValue;
use bittybuzz_tables::{Column, Kind};

use crate::data::{Cell, RunData, count, integer, optional_integer, text};

/// The columns of the table of runs.
pub struct RunsColumns {
    /// Each parameter, and true for one whose values are numbers.
    parameters: Vec<(String, bool)>,
    /// The names of the metrics, and the place of each in the list of all metrics.
    metrics: Vec<(String, usize)>,
}

/// The end of a run.
#[derive(Clone, Copy)]
pub enum RunEnd<'a> {
    Complete {
        summary: &'a Summary,
        digest: u64,
    },
    /// The run has ended early for this reason.
    Failed(&'a str),
}

impl RunsColumns {
    /// Returns the columns for runs of a scenario. `parameters` have the name of each parameter, and true
    /// for numbers.
    pub fn new(scenario: &Scenario, parameters: &[(String, bool)]) -> Self {
        let mut taken: BTreeSet<String> = parameters.iter().map(|(name, _)| name.clone()).collect();
        let metrics = metrics::metrics(scenario).into_iter().map(|metric| metric.name);
        // A quantity that `plot` has twice has one column.
        let metrics = (0..).zip(metrics).filter(|(_, name)| taken.insert(name.clone()));
        let metrics = metrics.map(|(place, name)| (name, place)).collect();
        RunsColumns { parameters: parameters.to_vec(), metrics }
    }

    /// Returns the table with the row of a run.
    pub fn table(
        &self,
        run: u32,
        seed: u32,
        values: &[ParameterValue],
        scenario: &Scenario,
        end: RunEnd<'_>,
    ) -> RunData {
        let parameters = self.parameters.iter().map(|(name, is_number)| match is_number {
            true => Column::new(name, Kind::OptionalNumber),
            false => text(name),
        });
        let metrics = self.metrics.iter();
        let metrics = metrics.map(|(name, _)| Column::new(name, Kind::OptionalNumber));
        let first = [integer("run")].into_iter().chain(parameters);
        let middle = [text("seed"), optional_integer("ticks"), optional_integer("robots")];
        let last = [text("digest"), text("error")];
        let columns = first.chain(middle).chain(metrics).chain(last).collect();
        let mut table = RunData::new("runs", columns);
        let values = self.parameters.iter().zip(values).map(|((_, is_number), value)| {
            match (is_number, value) {
                (true, ParameterValue::Integer(value)) => Cell::OptionalNumber(Some(*value as f64)),
                (true, ParameterValue::Float(value)) => Cell::OptionalNumber(Some(*value)),
                (true, _) => Cell::OptionalNumber(None),
                (false, value) => Cell::OptionalText(Some(value.to_string())),
            }
        });
        let text = |text: String| Cell::OptionalText(Some(text));
        let (numbers, found, digest, error) = match end {
            RunEnd::Complete { summary, digest } => (
                [summary.ticks, summary.robots as u64].map(|value| Some(count(value))),
                metrics::values(scenario, summary),
                text(format!("{digest:016x}")),
                Cell::OptionalText(None),
            ),
            RunEnd::Failed(error) => {
                ([None, None], Vec::new(), Cell::OptionalText(None), text(error.to_owned()))
            }
        };
        let metrics = self.metrics.iter().map(|(_, place)| found.get(*place).copied().flatten());
        let row = [Cell::Integer(count(run.into()))].into_iter().chain(values);
        let row = row.chain([text(seed.to_string())]);
        let row = row.chain(numbers.map(Cell::OptionalInteger));
        let row = row.chain(metrics.map(Cell::OptionalNumber));
        table.push(row.chain([digest, error]));
        table
    }
}

/// Returns true if all values are numbers.
pub fn are_numbers<'a>(mut values: impl Iterator<Item = &'a ParameterValue>) -> bool {
    values.all(|value| matches!(value, ParameterValue::Integer(_) | ParameterValue::Float(_)))
}
