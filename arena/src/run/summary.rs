//! What is told of a run when it is over.

use crate::engine::Statistics;

use super::expectation::{Convergence, Verdict};
use super::robot::FaultRecord;

/// A robot whose script has stopped, by its number in the scenario.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FaultOf {
    /// Number of the robot.
    pub robot: usize,
    /// What happened.
    pub record: FaultRecord,
}

/// A run in numbers.
#[derive(Debug, Clone)]
pub struct Summary {
    /// Seed of the run.
    pub seed: u32,
    /// Ticks that have passed.
    pub ticks: u64,
    /// Robots in the world.
    pub robots: usize,
    /// How the expectations fared, in the order of the file.
    pub convergences: Vec<Convergence>,
    /// Frames and contacts.
    pub statistics: Statistics,
    /// Frames that robots' queues had no room for: heard, and to be sent.
    pub dropped: [u64; 2],
    /// Scripts that have stopped, by time.
    pub faults: Vec<FaultOf>,
    /// Mean, smallest and largest of each quantity of `plot` at the end.
    pub values: Vec<Option<[f64; 3]>>,
}

impl Summary {
    /// Whether every expectation held and no script has stopped.
    pub fn is_success(&self) -> bool {
        let held = |convergence: &Convergence| convergence.verdict == Verdict::Held;
        self.faults.is_empty() && self.convergences.iter().all(held)
    }
}
