//! Figures of merit.

/// Returns the root of the mean square.
pub fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
}

/// Returns the mean.
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Returns the largest value.
pub fn worst(values: &[f64]) -> f64 {
    values.iter().fold(f64::MIN, |worst, value| worst.max(*value))
}

/// Returns the rise time from 10 to 90 % in seconds, and the overshoot as a share, of a step from 0
/// to `target` that is sampled every millisecond.
pub fn step_figures(values: &[f64], target: f64) -> (f64, f64) {
    let first = |share: f64| values.iter().position(|v| v / target >= share).expect("no rise");
    let rise_s = (first(0.9) - first(0.1)) as f64 * 1e-3;
    (rise_s, worst(&values.iter().map(|v| v / target).collect::<Vec<_>>()) - 1.0)
}
