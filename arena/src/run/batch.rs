//! Many runs at once: one run per thread, so that nothing is shared but the programs.

use std::sync::Arc;

use rayon::prelude::*;

use crate::scenario::ScenarioError;

use super::firmware::FirmwareError;
use super::setup::Setup;
use super::simulation::Simulation;
use super::summary::Summary;

/// Why runs were not done.
#[derive(Debug)]
pub enum BatchError {
    /// The world cannot be made.
    Scenario(ScenarioError),
    /// A run with emulated robots could not go on.
    Firmware {
        /// Seed of the run.
        seed: u32,
        /// Why.
        error: FirmwareError,
    },
}

/// Runs every setup with `runs` seeds, its own one and those after it; the summaries by setup, then seed. `on_done` is
/// called after each run.
pub fn batch(
    setups: &[(Arc<Setup>, u32)],
    runs: u32,
    on_done: impl Fn() + Sync,
) -> Result<Vec<Vec<Summary>>, BatchError> {
    let summaries: Result<Vec<Vec<Summary>>, BatchError> = setups
        .par_iter()
        .map(|(setup, first_seed)| {
            (0..runs)
                .into_par_iter()
                .map(|run| {
                    let seed = first_seed.wrapping_add(run);
                    let simulation = Simulation::new(setup.clone(), seed, 1);
                    let mut simulation = simulation.map_err(BatchError::Scenario)?;
                    while !simulation.is_over() {
                        let tick = simulation.tick();
                        tick.map_err(|error| BatchError::Firmware { seed, error })?;
                        // The log is not used here, and would grow.
                        simulation.take_log();
                    }
                    on_done();
                    Ok(simulation.summary())
                })
                .collect()
        })
        .collect();
    summaries
}
