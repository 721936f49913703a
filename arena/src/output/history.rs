//! Samples of a run in memory, for pictures.

use crate::run::{Simulation, TICKS_PER_SECOND};

/// The places and values of robots, sample by sample.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct History {
    /// Seconds.
    pub times: Vec<f64>,
    /// For each sample, where each robot was in mm; `None` before it joined.
    pub places: Vec<Vec<Option<[f32; 2]>>>,
    /// For each quantity of `plot` and each sample, its number for each robot, or the single one of the swarm; `None` where
    /// there is none.
    pub values: Vec<Vec<Vec<Option<f64>>>>,
}

impl History {
    /// Adds what is now.
    pub fn sample(&mut self, simulation: &Simulation) {
        let robots = 0..simulation.robot_count();
        self.times.push(simulation.now() as f64 / TICKS_PER_SECOND);
        let place = |robot| simulation.view(robot).map(|view| [view.pose.x, view.pose.y]);
        self.places.push(robots.map(place).collect());
        let probes = simulation.setup().plots();
        self.values.resize_with(probes.len(), Vec::new);
        for (samples, probe) in self.values.iter_mut().zip(probes) {
            samples.push(simulation.numbers(probe));
        }
    }
}
