//! Quantities of the ground that robots sense below them, such as its brightness.
//!
//! An [`Environment`] knows one quantity at every place. The world collects the places of the
//! sensors of all robots and asks once per tick for the values at all of them, so that an
//! environment costs one dynamic call in a tick, whatever the number of robots. A world without an
//! environment collects nothing.

use core::fmt::Debug;

use super::geometry::Pose;
use super::herd::{Cohort, Herd};

/// One quantity that depends on the place on the ground.
///
/// The `Debug` text contains the complete state, because digests of runs are computed from it.
pub trait Environment: Debug + Send + Sync {
    /// Returns a copy that continues exactly as the original would.
    fn copy(&self) -> Box<dyn Environment>;

    /// Writes the value at each place, [x, y] in mm. It is called once at the beginning of each
    /// tick, so an environment that changes with time does so here. The places are those of the
    /// sensors in the order of the robots' ids, and some may be outside of the world.
    fn sense(&mut self, places: &[[f32; 2]], values: &mut [f32]);
}

/// The environment of a world, with the places of this tick's sensors and their values.
#[derive(Debug)]
pub(crate) struct Ground {
    pub(crate) environment: Box<dyn Environment>,
    places: Vec<[f32; 2]>,
    values: Vec<f32>,
}

impl Clone for Ground {
    fn clone(&self) -> Self {
        Ground::new(self.environment.copy())
    }
}

impl Ground {
    pub(crate) fn new(environment: Box<dyn Environment>) -> Self {
        Ground { environment, places: Vec::new(), values: Vec::new() }
    }

    /// Reads the sensors of all robots.
    pub(crate) fn sense(&mut self, cohorts: &[Cohort], herds: &[Herd], poses: &[Pose]) {
        self.places.clear();
        for Cohort { herd, first, count, .. } in cohorts {
            let sensors = &herds[usize::from(herd.0)].ground_sensors;
            if sensors.is_empty() {
                continue;
            }
            for pose in &poses[*first..first + count] {
                let (sin, cos) = libm::sincosf(pose.heading);
                self.places.extend(sensors.iter().map(|[ahead, left]| {
                    [pose.x + ahead * cos - left * sin, pose.y + ahead * sin + left * cos]
                }));
            }
        }
        self.values.resize(self.places.len(), 0.0);
        self.environment.sense(&self.places, &mut self.values);
    }

    /// Returns the values of this tick, in the order of the robots' ids.
    pub(crate) fn values(&self) -> &[f32] {
        &self.values
    }
}
