//! Many runs at once: one run per thread, so that nothing is shared but the programs.

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

/// Runs every setup with every seed; the summaries by setup, then seed. `on_done` is called after each run.
pub fn batch(
    setups: &[Setup<'_>],
    seeds: &[u32],
    on_done: impl Fn() + Sync,
) -> Result<Vec<Vec<Summary>>, BatchError> {
    let jobs: Vec<(&Setup<'_>, u32)> =
        setups.iter().flat_map(|setup| seeds.iter().map(move |seed| (setup, *seed))).collect();
    let summaries: Result<Vec<Summary>, BatchError> = jobs
        .into_par_iter()
        .map(|(setup, seed)| {
            let casts = setup.casts();
            let simulation = Simulation::new(setup, &casts, seed, 1);
            let mut simulation = simulation.map_err(BatchError::Scenario)?;
            while !simulation.is_over() {
                let tick = simulation.tick();
                tick.map_err(|error| BatchError::Firmware { seed, error })?;
                // Nobody reads it, and it would grow.
                simulation.take_log();
            }
            on_done();
            Ok(simulation.summary())
        })
        .collect();
    Ok(summaries?.chunks(seeds.len().max(1)).map(<[Summary]>::to_vec).collect())
}
