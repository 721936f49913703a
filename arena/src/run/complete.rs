//! A complete run, from its first tick to its last, as one of many.

use std::fmt;
use std::sync::Arc;

use crate::scenario::ScenarioError;

use super::firmware::FirmwareError;
use super::setup::Setup;
use super::simulation::Simulation;
use super::summary::Summary;

/// A reason why a run has no summary.
#[derive(Debug)]
pub enum RunError {
    /// The world cannot be created from the scenario.
    Scenario(ScenarioError),
    /// The emulation of robots that run their firmware failed.
    Firmware(FirmwareError),
}

impl fmt::Display for RunError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            RunError::Scenario(error) => error.fmt(f),
            RunError::Firmware(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for RunError {}

/// Simulates a run to its end on the calling thread. Parallel runs share only the setup. Returns
/// `None` if `is_interrupted` returned true before a tick.
pub fn complete(
    setup: &Arc<Setup>,
    seed: u32,
    is_interrupted: impl Fn() -> bool,
) -> Result<Option<Summary>, RunError> {
    complete_observed(setup, seed, is_interrupted, |_| {})
}

/// Simulates a run as [`complete`] does, and calls `each` with it before its first tick and after
/// each tick, so that the caller can read more than the summary has.
pub fn complete_observed(
    setup: &Arc<Setup>,
    seed: u32,
    is_interrupted: impl Fn() -> bool,
    mut each: impl FnMut(&Simulation),
) -> Result<Option<Summary>, RunError> {
    let simulation = Simulation::new(setup.clone(), seed, 1);
    let mut simulation = simulation.map_err(RunError::Scenario)?;
    each(&simulation);
    while !simulation.is_over() {
        if is_interrupted() {
            return Ok(None);
        }
        simulation.tick().map_err(RunError::Firmware)?;
        // The log is not used here, and would grow without limit.
        simulation.take_log();
        each(&simulation);
    }
    Ok(Some(simulation.summary()))
}
