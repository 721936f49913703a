//! The finished runs of a sweep, and their metrics.

use std::collections::BTreeMap;

use bittybuzz_arena::output::metrics::Metric;
use bittybuzz_chunks::Outcome;

use super::super::super::study::Study;
use super::classes::Classes;
use super::estimate::Observation;

/// The finished runs of a sweep.
pub struct Results<'a> {
    pub study: &'a Study<'a>,
    /// The runs that came to their end, with their metrics.
    ended: Vec<(usize, Vec<Option<f64>>)>,
    /// The runs that could not go on, with the reasons.
    pub failed: Vec<(usize, String)>,
    /// The duration of the runs of each point, in s.
    durations: Vec<f64>,
}

impl<'a> Results<'a> {
    /// Sorts the outcomes of runs.
    pub fn new(study: &'a Study<'a>, outcomes: BTreeMap<usize, Outcome>) -> Self {
        let points = 0..study.runs.plan.points.len();
        let durations = points.map(|point| study.duration(point)).collect();
        let mut results = Results { study, ended: Vec::new(), failed: Vec::new(), durations };
        for (run, outcome) in outcomes {
            match outcome {
                Outcome::Complete { metrics, .. } => results.ended.push((run, metrics)),
                Outcome::Failed(reason) => results.failed.push((run, reason)),
            }
        }
        results
    }

    /// Returns the number of runs that came to their end.
    pub fn ended_count(&self) -> usize {
        self.ended.len()
    }

    /// Returns the places of the metrics that differ between runs.
    pub fn varying(&self) -> Vec<usize> {
        let bits = |value: Option<f64>| value.map(f64::to_bits);
        let varies = |metric: &usize| {
            let mut values = self.ended.iter().map(|(_, metrics)| bits(metrics[*metric]));
            let first = values.next();
            values.any(|value| Some(value) != first)
        };
        (0..self.study.metrics.len()).filter(varies).collect()
    }

    /// Returns the metric of a place.
    pub fn metric(&self, metric: usize) -> &Metric {
        &self.study.metrics[metric]
    }

    /// Returns a metric of all runs that came to their end, with their numbers.
    pub fn of_runs(&self, metric: usize) -> impl Iterator<Item = (usize, Observation)> {
        self.ended.iter().map(move |(run, metrics)| {
            let duration = self.durations[self.study.runs.point_of(*run)];
            (*run, Observation { value: metrics[metric], duration })
        })
    }

    /// Returns a metric of the runs of each class of a parameter, and of each class of another one within.
    pub fn of_classes(
        &self,
        metric: usize,
        classes: &Classes,
        within: Option<&Classes>,
    ) -> Vec<Vec<Vec<Observation>>> {
        let inner = within.map_or(1, |within| within.names.len());
        let mut sorted = vec![vec![Vec::new(); inner]; classes.names.len()];
        for (run, observation) in self.of_runs(metric) {
            let point = self.study.runs.point_of(run);
            let inner = within.map_or(0, |within| within.of_points[point]);
            sorted[classes.of_points[point]][inner].push(observation);
        }
        sorted
    }
}
