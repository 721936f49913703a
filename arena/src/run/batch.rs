//! Many runs at once: one run per thread, so that nothing is shared but the programs.

use rayon::prelude::*;

use crate::scenario::ScenarioError;

use super::setup::Setup;
use super::simulation::Simulation;
use super::summary::Summary;

/// Runs every setup with every seed; the summaries by setup, then seed. `on_done` is called after each run.
pub fn batch(
    setups: &[Setup<'_>],
    seeds: &[u32],
    on_done: impl Fn() + Sync,
) -> Result<Vec<Vec<Summary>>, ScenarioError> {
    let jobs: Vec<(&Setup<'_>, u32)> =
        setups.iter().flat_map(|setup| seeds.iter().map(move |seed| (setup, *seed))).collect();
    let summaries: Result<Vec<Summary>, ScenarioError> = jobs
        .into_par_iter()
        .map(|(setup, seed)| {
            let casts = setup.casts();
            let mut simulation = Simulation::new(setup, &casts, seed, 1)?;
            while !simulation.is_over() {
                simulation.tick();
                // Nobody reads it, and it would grow.
                simulation.take_log();
            }
            on_done();
            Ok(simulation.summary())
        })
        .collect();
    Ok(summaries?.chunks(seeds.len().max(1)).map(<[Summary]>::to_vec).collect())
}
