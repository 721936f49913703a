//! Sweeps: many runs of one scenario, with several values of some of its keys.
//!
//! A [`Plan`] has a list of points, each with a typed value of every parameter, and a number of
//! replicates of each point. It does not depend on the order in which runs are carried out, nor on
//! the computers that do so: run (point, replicate) has the same settings and the same seed
//! everywhere.
//!
//! # Principles
//! 1. **Names, not indices.** A parameter is a key of the scenario, with the names of groups
//!    instead of their numbers, and its column has its name.
//! 2. **Growth keeps runs.** More replicates, more values and more random points change
//!    neither the settings nor the seeds of the other runs. Only a Latin hypercube cannot grow.
//! 3. **Chance is chosen, not inherited**: [`Chance`] says if points share their random numbers.
//!
//! # Not included
//! Running, writing and scheduling. A plan is data.

mod design;
mod names;
mod set;
mod value;

pub use design::{Dimension, Draw, Range, draw};
pub use names::{KeyNames, UnknownName};
pub use set::{SetError, parse_set};
pub use value::{ParameterValue, RangeError, expand};

use bittybuzz_random::Random;
use bittybuzz_toml_reader::Place;

/// Keys that vary together, and their values.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// The keys, such as `medium.ir.loss`.
    pub keys: Vec<String>,
    /// The values, each with one for each key.
    pub rows: Vec<Vec<ParameterValue>>,
}

/// A key that has several values in a sweep.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// The key, as it was written.
    pub key: String,
    /// The name of its column.
    pub name: String,
    /// The place in the scenario that names it; `None` for `--set`.
    pub place: Option<Place>,
}

/// The random numbers of different points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Chance {
    /// Common random numbers: the replicates of all points have the same seeds, which count up.
    /// Differences between points are then less noisy, but points are not independent.
    Common,
    /// Each point has seeds of its own, which depend on its values alone.
    Independent,
}

impl Chance {
    /// The words of scenarios.
    pub const WORDS: [(&str, Chance); 2] =
        [("common", Chance::Common), ("independent", Chance::Independent)];
}

/// A plan of many runs.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    pub parameters: Vec<Parameter>,
    /// The points, each with a value of every parameter.
    pub points: Vec<Vec<ParameterValue>>,
    /// Runs of each point.
    pub replicates: u32,
    pub chance: Chance,
}

/// A plan with more runs than are allowed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("{replicates} runs of {points} combinations of values are too many")]
pub struct TooManyRuns {
    /// Runs of each point.
    pub replicates: u32,
    /// Points, at most the largest `usize`.
    pub points: usize,
}

/// Returns the number of combinations of the rows of some axes. Fails if they have more than `most`
/// runs together.
pub fn count_points(axes: &[Axis], replicates: u32, most: usize) -> Result<usize, TooManyRuns> {
    let mut points = 1_usize;
    for rows in std::iter::once(1).chain(axes.iter().map(|axis| axis.rows.len())) {
        points = points.saturating_mul(rows);
        if points.saturating_mul(replicates as usize) > most {
            return Err(TooManyRuns { replicates, points });
        }
    }
    Ok(points)
}

/// Returns all combinations of the rows of some axes; the last axis varies fastest. Fails if they
/// have more than `most` runs together.
pub fn cross(
    axes: &[Axis],
    replicates: u32,
    most: usize,
) -> Result<Vec<Vec<ParameterValue>>, TooManyRuns> {
    count_points(axes, replicates, most)?;
    let mut points = vec![Vec::new()];
    for axis in axes {
        let longer = |point: &Vec<ParameterValue>, row: &Vec<ParameterValue>| {
            point.iter().chain(row).cloned().collect()
        };
        points = points
            .iter()
            .flat_map(|point| axis.rows.iter().map(move |row| longer(point, row)))
            .collect();
    }
    Ok(points)
}

impl Plan {
    /// Returns the settings of a point, each as `KEY=VALUE`.
    pub fn settings(&self, point: &[ParameterValue]) -> Vec<String> {
        let settings = self.parameters.iter().zip(point);
        settings
            .map(|(parameter, value)| format!("{}={}", parameter.key, value.to_toml()))
            .collect()
    }

    /// Returns the seed of a replicate of a point, where `first` is the seed of the scenario.
    pub fn seed(&self, point: &[ParameterValue], replicate: u32, first: u32) -> u32 {
        match self.chance {
            Chance::Common => first.wrapping_add(replicate),
            Chance::Independent => {
                // The order of the keys is not a property of the point.
                let mut settings = self.settings(point);
                settings.sort_unstable();
                let of_point = settings.iter().fold(u64::from(first), |hash, setting| {
                    let bytes = setting.bytes().chain([0]);
                    bytes.fold(hash, |hash, byte| Random::for_purpose(hash, byte.into()).bits())
                });
                (Random::for_item(of_point, replicate.into()).bits() >> 32) as u32
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(set: &str) -> Axis {
        parse_set(set).unwrap()
    }

    fn plan(chance: Chance, sets: &[&str]) -> Plan {
        let axes: Vec<Axis> = sets.iter().map(|set| axis(set)).collect();
        let parameter =
            |key: &String| Parameter { key: key.clone(), name: key.clone(), place: None };
        let parameters = axes.iter().flat_map(|axis| &axis.keys).map(parameter).collect();
        Plan { parameters, points: cross(&axes, 3, 100).unwrap(), replicates: 3, chance }
    }

    #[test]
    fn all_rows_are_combined() {
        let plan = plan(Chance::Common, &["a=1,2", "b=x,y; c=0.5,1.0"]);
        let settings: Vec<String> =
            plan.points.iter().map(|point| plan.settings(point).join(" ")).collect();
        assert_eq!(settings, ["a=1 b=x c=0.5", "a=1 b=y c=1.0", "a=2 b=x c=0.5", "a=2 b=y c=1.0"]);
    }

    #[test]
    fn the_number_of_runs_is_limited() {
        let axes = [axis("a=1:100"), axis("b=1:100")];
        assert_eq!(cross(&axes, 10, 100_000).map(|points| points.len()), Ok(10_000));
        let error = cross(&axes, 11, 100_000).unwrap_err();
        assert_eq!(error, TooManyRuns { replicates: 11, points: 10_000 });
        assert_eq!(cross(&[], 11, 10), Err(TooManyRuns { replicates: 11, points: 1 }));
        assert_eq!(cross(&[], 10, 10), Ok(vec![Vec::new()]));
    }

    #[test]
    fn common_random_numbers_are_those_of_every_point() {
        let plan = plan(Chance::Common, &["a=1,2"]);
        for point in &plan.points {
            let seeds: Vec<u32> = (0..3).map(|number| plan.seed(point, number, 7)).collect();
            assert_eq!(seeds, [7, 8, 9]);
        }
        assert_eq!(plan.seed(&plan.points[0], 2, u32::MAX), 1);
    }

    #[test]
    fn independent_points_have_seeds_of_their_values() {
        let seeds = |sets: &[&str]| -> Vec<(String, Vec<u32>)> {
            let plan = plan(Chance::Independent, sets);
            let of_point = |point: &Vec<ParameterValue>| {
                let mut settings = plan.settings(point);
                settings.sort();
                (settings.join(" "), (0..3).map(|run| plan.seed(point, run, 1)).collect())
            };
            let mut seeds: Vec<(String, Vec<u32>)> = plan.points.iter().map(of_point).collect();
            seeds.sort();
            seeds
        };
        let few = seeds(&["a=1,2", "b=3,4"]);
        let mut all: Vec<u32> = few.iter().flat_map(|(_, seeds)| seeds.clone()).collect();
        all.sort_unstable();
        all.dedup();
        assert_eq!(all.len(), 12);
        // Another order of values and keys, and more values, change no seed of these points.
        let more = seeds(&["b=5,4,3", "a=2,1,0"]);
        assert!(few.iter().all(|point| more.contains(point)), "{few:?}\n{more:?}");
    }
}
