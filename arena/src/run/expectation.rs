//! The evaluation of a scenario's expectations.

use crate::scenario::{Expect, ExpectedValue, Of, Reduction, Scenario, Test, When};

use super::quantity::{QuantityProbe, QuantityReading};
use super::tick_at;

/// An expectation whose names are resolved.
#[derive(Debug, Clone, PartialEq)]
pub struct Bound {
    pub expect: Expect,
    pub probe: QuantityProbe,
    /// The first and the last tick at which the condition counts.
    window: (u64, u64),
}

/// The outcome of an expectation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// The outcome is not decided yet.
    Open,
    /// The condition was true when it had to be.
    Held,
    /// The condition was false when it had to be true.
    Failed,
}

/// The state of an expectation during a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Convergence {
    /// The outcome so far.
    pub verdict: Verdict,
    /// The first tick at which the condition was true.
    pub first: Option<u64>,
    /// The tick since which the condition has been true without a break, regardless of the times of
    /// the expectation.
    pub since: Option<u64>,
    /// The tick at which the verdict became [`Verdict::Held`].
    pub held_at: Option<u64>,
    /// The tick at which the verdict became [`Verdict::Failed`].
    pub failed_at: Option<u64>,
    /// The robot with the lowest number whose value did not pass at `failed_at`, and this value.
    /// Only for an expectation that every robot has to pass.
    pub against: Option<(usize, f64)>,
}

impl Convergence {
    /// The state before the first check.
    pub const START: Convergence = Convergence {
        verdict: Verdict::Open,
        first: None,
        since: None,
        held_at: None,
        failed_at: None,
        against: None,
    };
}

impl Bound {
    pub fn new(expect: &Expect, probe: QuantityProbe, scenario: &Scenario) -> Self {
        let end = tick_at(scenario.world.duration);
        let window = match expect.when {
            When::At(time) => (tick_at(time), tick_at(time)),
            When::Within(time) => (0, tick_at(time)),
            When::Always(from, to) => (tick_at(from), tick_at(to)),
        };
        let window = (window.0.min(end), window.1.min(end));
        Bound { expect: expect.clone(), probe, window }
    }

    /// Updates the state with the result of the condition at a tick.
    pub fn update(&self, convergence: &mut Convergence, tick: u64, is_true: bool) {
        convergence.since = match (is_true, convergence.since) {
            (true, None) => Some(tick),
            (true, since) => since,
            (false, _) => None,
        };
        convergence.first = convergence.first.or(convergence.since);
        let (from, to) = self.window;
        if convergence.verdict != Verdict::Open || tick < from {
            return;
        }
        let is_within = matches!(self.expect.when, When::Within(_));
        convergence.verdict = match is_true {
            true if is_within || tick >= to => Verdict::Held,
            false if !is_within || tick >= to => Verdict::Failed,
            _ => Verdict::Open,
        };
        match convergence.verdict {
            Verdict::Open => {}
            Verdict::Held => convergence.held_at = Some(tick),
            Verdict::Failed => convergence.failed_at = Some(tick),
        }
    }

    /// Returns the first of these robots whose value does not pass the test, and the value, if
    /// every robot has to pass.
    pub fn against<'p>(
        &self,
        mut readings: impl Iterator<Item = (usize, QuantityReading<'p>)>,
    ) -> Option<(usize, f64)> {
        let Expect { of: Of::All, test: Some(test), tolerance, .. } = &self.expect else {
            return None;
        };
        let (robot, reading) = readings.find(|(_, reading)| !passes(test, reading, *tolerance))?;
        Some((robot, reading.number()?))
    }

    /// Returns true if the condition is true of these readings. nil passes only the test for
    /// existence, and agrees with nothing.
    pub fn is_true<'p>(&self, readings: impl Iterator<Item = QuantityReading<'p>> + Clone) -> bool {
        let Expect { of, test, tolerance, .. } = &self.expect;
        let mut readings = readings;
        let passes = |reading: QuantityReading<'p>| match test {
            Some(test) => passes(test, &reading, *tolerance),
            None => true,
        };
        match of {
            Of::All => readings.all(passes),
            Of::Any => readings.any(passes),
            Of::None if matches!(test, Some(Test::Exists(_))) => !readings.any(passes),
            Of::None => !readings.any(|reading| reading == QuantityReading::Nil || passes(reading)),
            Of::One => readings.filter(|reading| passes(*reading)).take(2).count() == 1,
            Of::AtLeast(count) => {
                let count = *count as usize;
                readings.filter(|reading| passes(*reading)).take(count).count() == count
            }
            Of::Agree => {
                // No robots agree.
                let Some(first) = readings.clone().next() else { return true };
                readings.all(|reading| reading.is_like(&first, *tolerance) && passes(reading))
            }
            Of::Reduced(reduction) => reduce(*reduction, readings)
                .is_some_and(|number| passes(QuantityReading::Number(number))),
        }
    }
}

fn passes(test: &Test, reading: &QuantityReading<'_>, tolerance: f64) -> bool {
    let is_like = |wanted: &ExpectedValue| match wanted {
        ExpectedValue::Number(number) => {
            reading.is_like(&QuantityReading::Number(*number), tolerance)
        }
        ExpectedValue::Text(text) => reading.is_like(&QuantityReading::Text(text), 0.0),
    };
    let number = reading.number();
    match test {
        Test::Equals(wanted) => is_like(wanted),
        Test::Differs(wanted) => *reading != QuantityReading::Nil && !is_like(wanted),
        Test::Below(limit) => number.is_some_and(|number| number < *limit),
        Test::Above(limit) => number.is_some_and(|number| number > *limit),
        Test::Between(low, high) => number.is_some_and(|number| (*low..=*high).contains(&number)),
        Test::Exists(exists) => (*reading != QuantityReading::Nil) == *exists,
    }
}

/// Reduces many readings to one number; `None` if no reading has a value.
pub fn reduce<'p>(
    reduction: Reduction,
    readings: impl Iterator<Item = QuantityReading<'p>>,
) -> Option<f64> {
    if reduction == Reduction::Different {
        let mut seen: Vec<QuantityReading<'p>> = Vec::new();
        for reading in readings {
            if reading != QuantityReading::Nil && !seen.contains(&reading) {
                seen.push(reading);
            }
        }
        return (!seen.is_empty()).then_some(seen.len() as f64);
    }
    let (mut count, mut sum, mut min, mut max) = (0.0, 0.0, f64::INFINITY, f64::NEG_INFINITY);
    for number in readings.filter_map(|reading| reading.number()) {
        count += 1.0;
        sum += number;
        min = min.min(number);
        max = max.max(number);
    }
    (count > 0.0).then_some(match reduction {
        Reduction::Mean => sum / count,
        Reduction::Sum => sum,
        Reduction::Min => min,
        Reduction::Max => max,
        Reduction::Spread | Reduction::Different => max - min,
    })
}
