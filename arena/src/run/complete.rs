//! A complete run, from its first tick to its last, as one of many.

use std::fmt;
use std::sync::Arc;

use crate::scenario::ScenarioError;

use super::firmware::FirmwareError;
use super::observer::Observer;
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

/// A reader of a run between its ticks, and perhaps in them. A function of the simulation is one.
pub trait RunWatcher {
    /// Returns the observer of the next tick, if there is one.
    fn observer(&mut self) -> Option<&mut dyn Observer> {
        None
    }

    /// Reads the run before its first tick, or after a tick.
    fn read(&mut self, simulation: &Simulation);
}

impl<F: FnMut(&Simulation)> RunWatcher for F {
    fn read(&mut self, simulation: &Simulation) {
        self(simulation);
    }
}

/// Simulates a run to its end on the calling thread. Parallel runs share only the setup. Returns
/// `None` if `is_interrupted` returned true before a tick.
pub fn complete(
    setup: &Arc<Setup>,
    seed: u32,
    is_interrupted: impl Fn() -> bool,
) -> Result<Option<Summary>, RunError> {
    complete_watched(setup, seed, is_interrupted, &mut |_: &Simulation| {})
}

/// Simulates a run as [`complete`] does, for a caller that reads more than the summary has.
pub fn complete_watched(
    setup: &Arc<Setup>,
    seed: u32,
    is_interrupted: impl Fn() -> bool,
    watcher: &mut dyn RunWatcher,
) -> Result<Option<Summary>, RunError> {
    let simulation = Simulation::new(setup.clone(), seed, 1);
    let mut simulation = simulation.map_err(RunError::Scenario)?;
    watcher.read(&simulation);
    while !simulation.is_over() {
        if is_interrupted() {
            return Ok(None);
        }
        let ticked = match watcher.observer() {
            Some(observer) => simulation.tick_observed(observer),
            None => simulation.tick(),
        };
        ticked.map_err(RunError::Firmware)?;
        // The log is not used here, and would grow without limit.
        simulation.take_log();
        watcher.read(&simulation);
    }
    Ok(Some(simulation.summary()))
}
