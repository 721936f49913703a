//! The number of a metric in some runs, with its interval.

use bittybuzz_arena::output::metrics::MetricKind;
use bittybuzz_arena::statistics::{EventTime, kaplan_meier, quartiles};

/// A metric of a run that has come to its end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observation {
    pub value: Option<f64>,
    /// The duration of the run in s.
    pub duration: f64,
}

/// A quantile of the normal distribution for intervals of 95 %.
const NORMAL: f64 = 1.959_964;

/// A number that stands for some runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// The number of runs.
    pub runs: usize,
    /// Runs without a value.
    pub missing: usize,
    /// Lower quartile, median and upper quartile; of truths the share with the limits of its interval.
    pub interval: Option<[f64; 3]>,
}

/// Returns the estimate of a metric.
pub fn estimate(kind: MetricKind, observations: &[Observation]) -> Estimate {
    let values: Vec<f64> =
        observations.iter().filter_map(|observation| observation.value).collect();
    let interval = match kind {
        MetricKind::Success | MetricKind::Held | MetricKind::Truth => share(&values),
        MetricKind::Number => {
            quartiles(&values).map(|[_, lower, median, upper, _]| [lower, median, upper])
        }
        MetricKind::Time => times(observations),
    };
    let runs = observations.len();
    Estimate { runs, missing: runs - values.len(), interval }
}

/// Returns words for the middle numbers of a metric's estimates, and for their intervals.
pub fn words(kind: MetricKind) -> [&'static str; 2] {
    match kind {
        MetricKind::Success | MetricKind::Held | MetricKind::Truth => {
            ["Share", " and its 95 % interval (Wilson)"]
        }
        MetricKind::Number => ["Median", " and quartiles"],
        MetricKind::Time => ["Median time (Kaplan and Meier)", " and quartiles"],
    }
}

/// Returns the share of truths with the interval of Wilson (1927), which is none of negative shares and is
/// right for few runs, too.
fn share(values: &[f64]) -> Option<[f64; 3]> {
    let count = values.len() as f64;
    if values.is_empty() {
        return None;
    }
    let share = values.iter().filter(|value| **value == 1.0).count() as f64 / count;
    let square = NORMAL * NORMAL;
    let middle = (share + square / (2.0 * count)) / (1.0 + square / count);
    let variance = share * (1.0 - share) / count + square / (4.0 * count * count);
    let half = NORMAL / (1.0 + square / count) * variance.sqrt();
    Some([(middle - half).min(share), share, (middle + half).max(share)])
}

/// Returns the quartiles of times to an event. A run that ended before it counts until its end, which also
/// stands for a quartile that no event reaches.
fn times(observations: &[Observation]) -> Option<[f64; 3]> {
    let time = |observation: &Observation| EventTime {
        time: observation.value.unwrap_or(observation.duration),
        is_reached: observation.value.is_some(),
    };
    let times: Vec<EventTime> = observations.iter().map(time).collect();
    let median = kaplan_meier(&times, 0.5)?;
    let longest =
        observations.iter().map(|observation| observation.duration).fold(median, f64::max);
    let lower = kaplan_meier(&times, 0.75).unwrap_or(median);
    Some([lower, median, kaplan_meier(&times, 0.25).unwrap_or(longest)])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn observations(values: &[Option<f64>]) -> Vec<Observation> {
        values.iter().map(|value| Observation { value: *value, duration: 900.0 }).collect()
    }

    /// The interval is that of `binomtest(8, 30).proportion_ci(method="wilson")` in SciPy 1.17.1.
    #[test]
    fn a_share_has_the_interval_of_wilson() {
        let values: Vec<Option<f64>> =
            (0..30).map(|run| Some(f64::from(u8::from(run < 8)))).collect();
        let found = estimate(MetricKind::Held, &observations(&values)).interval.unwrap();
        let expected = [0.141_826_633, 0.266_666_667, 0.444_479_617];
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-8, "{found} {expected}");
        }
        for (values, expected) in [([0.0; 4], 0.0), ([1.0; 4], 1.0)] {
            let [low, share, high] = share(&values).unwrap();
            assert!(share == expected && 0.0 <= low && high <= 1.0, "{low} {high}");
        }
    }

    #[test]
    fn runs_without_the_event_count_until_their_end() {
        let time = |values: &[Option<f64>]| estimate(MetricKind::Time, &observations(values));
        let found = time(&[Some(100.0), None, Some(300.0), Some(200.0)]);
        assert_eq!((found.runs, found.missing), (4, 1));
        // Of four, one is left after 300 s, so the upper quartile is then.
        assert_eq!(found.interval, Some([100.0, 200.0, 300.0]));
        // Two of five reach the event: no median.
        assert_eq!(time(&[Some(100.0), Some(200.0), None, None, None]).interval, None);
        // Three of five: the end stands for the upper quartile.
        let found = time(&[Some(100.0), Some(200.0), Some(300.0), None, None]);
        assert_eq!(found.interval, Some([200.0, 300.0, 900.0]));
    }

    #[test]
    fn missing_numbers_are_left_out() {
        let found = estimate(MetricKind::Number, &observations(&[Some(1.0), None, Some(3.0)]));
        assert_eq!(found, Estimate { runs: 3, missing: 1, interval: Some([1.5, 2.0, 2.5]) });
        assert_eq!(estimate(MetricKind::Number, &[]).interval, None);
        assert_eq!(estimate(MetricKind::Held, &[]).interval, None);
    }
}
