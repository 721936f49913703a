//! Samples of a run in memory, for pictures.

use crate::run::{Simulation, TICKS_PER_SECOND};

/// The places and values of robots, and the places of the discs that they push, sample by sample.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct History {
    /// The times of the samples in seconds.
    pub times: Vec<f64>,
    /// The position of each robot in mm in each sample; `None` before the robot joined.
    pub places: Vec<Vec<Option<[f32; 2]>>>,
    /// The center of each movable disc in mm in each sample.
    pub movables: Vec<Vec<[f32; 2]>>,
    /// The number of each robot, or the single one of the swarm, for each quantity of `plot` and
    /// each sample; `None` if there is no number.
    pub values: Vec<Vec<Vec<Option<f64>>>>,
}

impl History {
    /// Adds a sample of the current state.
    pub fn sample(&mut self, simulation: &Simulation) {
        let robots = 0..simulation.robot_count();
        self.times.push(simulation.now() as f64 / TICKS_PER_SECOND);
        let place = |robot| simulation.view(robot).map(|view| [view.pose.x, view.pose.y]);
        self.places.push(robots.map(place).collect());
        self.movables.push(simulation.movables().map(|disc| [disc.x, disc.y]).collect());
        let probes = simulation.setup().plots();
        self.values.resize_with(probes.len(), Vec::new);
        for (samples, probe) in self.values.iter_mut().zip(probes) {
            samples.push(simulation.numbers(probe));
        }
    }
}
