//! The evaluation of a scenario's expectations.

use crate::scenario::{Expect, Scenario, When};

use super::quantity::QuantityProbe;
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
}
