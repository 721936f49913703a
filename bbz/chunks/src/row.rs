//! Runs and their results.

use std::fmt;

use serde::{Deserialize, Serialize};

/// The name of a run: its settings and its seed, which decide its results.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct RunKey {
    /// Each `KEY=VALUE`, sorted.
    settings: Vec<String>,
    seed: u32,
}

impl RunKey {
    /// Returns the key of a run. The order of the settings does not count.
    pub fn new(mut settings: Vec<String>, seed: u32) -> Self {
        settings.sort_unstable();
        RunKey { settings, seed }
    }
}

impl fmt::Display for RunKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.settings.iter().try_for_each(|setting| write!(f, "{setting}, "))?;
        write!(f, "seed {}", self.seed)
    }
}

/// The result of a run.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// The run has come to its end.
    Complete {
        /// In the order of [`Experiment::metrics`](crate::Experiment::metrics); `None` where the run has none.
        metrics: Vec<Option<f64>>,
        /// The digest of the state at the end.
        digest: u64,
    },
    /// The run could not go on, for this reason.
    Failed(String),
}

impl Outcome {
    /// Returns true for equal bits, which numbers that are not a number have, too.
    pub fn is_same(&self, other: &Outcome) -> bool {
        let bits = |metrics: &[Option<f64>]| -> Vec<Option<u64>> {
            metrics.iter().map(|metric| metric.map(f64::to_bits)).collect()
        };
        match (self, other) {
            (
                Outcome::Complete { metrics, digest },
                Outcome::Complete { metrics: others, digest: other },
            ) => digest == other && bits(metrics) == bits(others),
            (Outcome::Failed(reason), Outcome::Failed(other)) => reason == other,
            _ => false,
        }
    }
}

/// A run with its result.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    pub key: RunKey,
    pub outcome: Outcome,
}

/// A row as a line of JSON.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Line {
    settings: Vec<String>,
    seed: u32,
    /// Numbers with commas between them: JSON has no infinite numbers.
    #[serde(skip_serializing_if = "Option::is_none")]
    metrics: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    digest: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<String>,
}

impl Row {
    /// Returns the row as a line without its end.
    pub(crate) fn to_line(&self) -> String {
        let RunKey { settings, seed } = self.key.clone();
        let line = match &self.outcome {
            Outcome::Complete { metrics, digest } => {
                // The shortest text that is read as the same number.
                let texts =
                    metrics.iter().map(|metric| metric.map_or(String::new(), |m| m.to_string()));
                let metrics = Some(texts.collect::<Vec<String>>().join(","));
                Line {
                    settings,
                    seed,
                    metrics,
                    digest: Some(format!("{digest:016x}")),
                    error: None,
                }
            }
            Outcome::Failed(reason) => {
                Line { settings, seed, metrics: None, digest: None, error: Some(reason.clone()) }
            }
        };
        serde_json::to_string(&line).expect("strings and numbers are valid JSON")
    }

    /// Parses a line with this number of metrics.
    pub(crate) fn parse(line: &str, metrics_count: usize) -> Option<Row> {
        let Line { settings, seed, metrics, digest, error } = serde_json::from_str(line).ok()?;
        let outcome = match (metrics, digest, error) {
            (Some(metrics), Some(digest), None) => {
                let metric = |cell: &str| match cell {
                    "" => Some(None),
                    number => number.parse().ok().map(Some),
                };
                let metrics: Vec<Option<f64>> =
                    metrics.split(',').map(metric).collect::<Option<_>>()?;
                (metrics.len() == metrics_count).then_some(())?;
                Outcome::Complete { metrics, digest: u64::from_str_radix(&digest, 16).ok()? }
            }
            (None, None, Some(reason)) => Outcome::Failed(reason),
            _ => return None,
        };
        Some(Row { key: RunKey::new(settings, seed), outcome })
    }
}
