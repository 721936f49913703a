//! The columns of a table of runs.

use crate::engine::WorldStatistics;
use crate::robot::FaultCounts;
use crate::run::{Summary, TICKS_PER_SECOND, Unusable, Verdict};
use crate::scenario::{MeasureTime, Scenario};

/// A column of the table, with a number of each run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Metric {
    /// The name of the column.
    pub name: String,
    /// The meaning of its numbers.
    pub kind: MetricKind,
}

/// The meaning of a metric's numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MetricKind {
    /// The success of the run: 1, or 0.
    Success,
    /// An expectation: 1 if it held, else 0.
    Held,
    /// The truth of a condition: 1 if it was true, else 0.
    Truth,
    /// A number; a run may have none.
    Number,
    /// The time of an event in seconds. A run that ended before the event has none.
    Time,
}

/// Returns the metrics of a scenario's runs.
pub fn metrics(scenario: &Scenario) -> Vec<Metric> {
    let mut metrics = Vec::new();
    let mut add = |kind, name: String| metrics.push(Metric { name, kind });
    add(MetricKind::Success, "success".to_owned());
    add(MetricKind::Number, "failed".to_owned());
    for measure in &scenario.measures {
        let kind = match measure.time {
            MeasureTime::First => MetricKind::Time,
            _ if measure.is_of_condition() => MetricKind::Truth,
            _ => MetricKind::Number,
        };
        add(kind, measure.name.clone());
    }
    for (number, expect) in scenario.expects.iter().enumerate() {
        // An expectation without a name has its index, because a line number would change with
        // every comment above it.
        let name = expect.name.clone().unwrap_or_else(|| number.to_string());
        add(MetricKind::Held, format!("held.{name}"));
        for word in ["first", "since"] {
            add(MetricKind::Time, format!("{word}.{name}"));
        }
    }
    for (quantity, _) in &scenario.output.plot {
        match quantity.is_of_swarm() {
            true => add(MetricKind::Number, quantity.to_string()),
            false => ["mean", "min", "max"]
                .into_iter()
                .for_each(|word| add(MetricKind::Number, format!("{word} {quantity}"))),
        }
    }
    let counts = ["sent", "received", "lost", "collided", "deaf", "unsent", "unread"];
    let unusable = Unusable::default().counts().map(|(name, _)| name);
    let counts = counts.into_iter().chain(unusable).chain(["contacts", "crashes"]);
    counts.for_each(|name| add(MetricKind::Number, name.to_owned()));
    add(MetricKind::Time, "first_crash".to_owned());
    ["faults", "restarts", "handler_faults", "overruns"]
        .into_iter()
        .for_each(|name| add(MetricKind::Number, name.to_owned()));
    metrics
}

/// Returns the metrics of a run of that scenario.
pub fn values(scenario: &Scenario, summary: &Summary) -> Vec<Option<f64>> {
    let truth = |is: bool| Some(f64::from(u8::from(is)));
    let held = |verdict: Verdict| verdict == Verdict::Held;
    let verdicts = summary.convergences.iter().map(|convergence| convergence.verdict);
    let failed = verdicts.filter(|verdict| !held(*verdict)).count();
    let mut values = vec![truth(summary.is_success()), Some(failed as f64)];
    values.extend(&summary.measures);
    for convergence in &summary.convergences {
        values.push(truth(held(convergence.verdict)));
        let times = [convergence.first, convergence.since];
        values.extend(times.map(|tick| Some(tick? as f64 / TICKS_PER_SECOND)));
    }
    for ((quantity, _), value) in scenario.output.plot.iter().zip(&summary.values) {
        let value = value.map_or([None; 3], |value| value.map(Some));
        let columns = if quantity.is_of_swarm() { 1 } else { value.len() };
        values.extend(&value[..columns]);
    }
    let links = summary.statistics.all_links();
    let [unread, unsent] = summary.dropped;
    let counts = [links.sent, links.received, links.lost, links.collided, links.deaf];
    let unusable = summary.unusable.counts().map(|(_, count)| count);
    let counts = counts.into_iter().chain([unsent, unread]).chain(unusable);
    let FaultCounts { faults, restarts, handler_faults } = summary.fault_counts;
    let overruns = summary.overruns.missed;
    let WorldStatistics { contacts, crashes, .. } = summary.statistics;
    values.extend(counts.chain([contacts, crashes]).map(|count| Some(count as f64)));
    values.push(summary.first_crash.map(|(tick, _)| tick as f64 / TICKS_PER_SECOND));
    values.extend([faults, restarts, handler_faults, overruns].map(|count| Some(count as f64)));
    values
}
