//! Outcomes of a scenario's expectations.

use bittybuzz_arena::run::{Simulation, TICKS_PER_SECOND, Verdict};
use pyo3::prelude::*;

/// An expectation of the scenario and its current outcome.
#[pyclass(frozen, get_all, eq, module = "bittybuzz")]
#[derive(Debug, Clone, PartialEq)]
pub struct Expectation {
    pub text: String,
    pub name: Option<String>,
    pub line: usize,
    pub verdict: &'static str,
    pub first: Option<f64>,
    pub since: Option<f64>,
    pub held_at: Option<f64>,
    pub failed_at: Option<f64>,
    pub against: Option<(u16, f64)>,
}

/// Returns the expectations in the order of the file.
pub fn all(run: &Simulation) -> Vec<Expectation> {
    let setup = run.setup();
    let seconds = |tick: Option<u64>| tick.map(|tick| tick as f64 / TICKS_PER_SECOND);
    let expects = setup.scenario.expects.iter().zip(run.convergences());
    let expects = expects.map(|(expect, convergence)| Expectation {
        text: expect.to_string(),
        name: expect.name.clone(),
        line: expect.condition.place.line,
        verdict: match convergence.verdict {
            Verdict::Open => "open",
            Verdict::Held => "held",
            Verdict::Failed => "failed",
        },
        first: seconds(convergence.first),
        since: seconds(convergence.since),
        held_at: seconds(convergence.held_at),
        failed_at: seconds(convergence.failed_at),
        against: convergence.against.map(|(robot, number)| (setup.id(robot), number)),
    });
    expects.collect()
}

#[pymethods]
impl Expectation {
    fn __repr__(&self) -> String {
        format!("<Expectation {}: {}>", self.text, self.verdict)
    }
}
