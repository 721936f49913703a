//! The runs of a plan, by number: run `point * replicates + replicate`.

use std::sync::Arc;

use bittybuzz_arena::sweep::{ParameterValue, Plan};
use bittybuzz_chunks::RunKey;

use super::arguments::SEED;

/// The runs of a plan.
pub struct Runs {
    pub plan: Plan,
    /// The seed of `--seed`.
    pub seed: Option<u32>,
    /// The seed of the scenario.
    pub world_seed: u32,
}

impl Runs {
    /// Returns the number of runs.
    pub fn count(&self) -> usize {
        self.plan.points.len() * self.plan.replicates as usize
    }

    /// Returns the point of a run.
    pub fn point_of(&self, run: usize) -> usize {
        run / self.plan.replicates as usize
    }

    /// Returns the settings of a point.
    pub fn settings(&self, point: usize) -> Vec<String> {
        self.plan.settings(&self.plan.points[point])
    }

    /// Returns the seed of a run.
    pub fn seed(&self, run: usize) -> u32 {
        let point = &self.plan.points[self.point_of(run)];
        let keys = self.plan.parameters.iter().map(|parameter| parameter.key.as_str());
        let own = keys.zip(point).find(|(key, _)| *key == SEED);
        // A point may set the seed.
        let first = match (self.seed, own) {
            (Some(seed), _) => seed,
            // The scenario of the point has no other number than this: others are mistakes.
            (None, Some((_, ParameterValue::Integer(seed)))) => *seed as u32,
            (None, _) => self.world_seed,
        };
        self.plan.seed(point, (run % self.plan.replicates as usize) as u32, first)
    }

    /// Returns the key of a run.
    pub fn key(&self, run: usize) -> RunKey {
        RunKey::new(self.settings(self.point_of(run)), self.seed(run))
    }

    /// Returns the values of a point as cells of a table.
    pub fn cells(&self, point: usize) -> Arc<[String]> {
        self.plan.points[point].iter().map(ToString::to_string).collect()
    }

    /// Returns the names of the parameters' columns.
    pub fn columns(&self) -> Vec<String> {
        self.plan.parameters.iter().map(|parameter| parameter.name.clone()).collect()
    }
}
