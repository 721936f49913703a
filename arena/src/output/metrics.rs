//! The columns of a table of runs.

use crate::engine::WorldStatistics;
use crate::robot::FaultCounts;
use crate::run::{Summary, TICKS_PER_SECOND, Unusable, Verdict};
use crate::scenario::{Quantity, Scenario};

/// Returns the names of the metrics of a scenario's runs.
pub fn names(scenario: &Scenario) -> Vec<String> {
    let mut names = vec!["success".to_owned()];
    for (number, expect) in scenario.expects.iter().enumerate() {
        // An expectation without a name has its index, because a line number would change with
        // every comment above it.
        let name = expect.name.clone().unwrap_or_else(|| number.to_string());
        names.extend(["held", "first", "since"].map(|word| format!("{word}.{name}")));
    }
    for (quantity, _) in &scenario.output.plot {
        match quantity {
            Quantity::Swarm(_) => names.push(quantity.to_string()),
            _ => names.extend(["mean", "min", "max"].map(|word| format!("{word} {quantity}"))),
        }
    }
    let counts = ["sent", "received", "lost", "collided", "deaf", "unsent", "unread"];
    names.extend(counts.map(str::to_owned));
    let unusable = Unusable::default().counts();
    names.extend(unusable.map(|(name, _)| name.to_owned()));
    let names_of_last =
        ["contacts", "crashes", "first_crash", "faults", "restarts", "handler_faults", "overruns"];
    names.extend(names_of_last.map(str::to_owned));
    names
}

/// Returns the metrics of a run of that scenario.
pub fn values(scenario: &Scenario, summary: &Summary) -> Vec<Option<f64>> {
    let truth = |is: bool| Some(f64::from(u8::from(is)));
    let mut values = vec![truth(summary.is_success())];
    for convergence in &summary.convergences {
        values.push(truth(convergence.verdict == Verdict::Held));
        let times = [convergence.first, convergence.since];
        values.extend(times.map(|tick| Some(tick? as f64 / TICKS_PER_SECOND)));
    }
    for ((quantity, _), value) in scenario.output.plot.iter().zip(&summary.values) {
        let value = value.map_or([None; 3], |value| value.map(Some));
        let columns = if matches!(quantity, Quantity::Swarm(_)) { 1 } else { value.len() };
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
