//! What is told of a run when it is over.

use bittybuzz_vm_core::Counters;

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

/// Messages that robots heard and could not use, all robots together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Unusable {
    /// Of another script.
    pub foreign: u64,
    /// Without sense.
    pub malformed: u64,
    /// From a robot with the receiver's id.
    pub own_id: u64,
    /// Entries of stigmergies for which there was no room; they were passed on.
    pub not_kept: u64,
    /// Messages of which a fragment was missing.
    pub incomplete: u64,
    /// Conflicts that a handler did not decide.
    pub undecided: u64,
    /// Messages whose listener or handler ended with a fault.
    pub failed: u64,
}

impl Unusable {
    /// Adds those of a robot.
    pub(super) fn add(mut self, robot: Counters) -> Self {
        for (sum, count) in [
            (&mut self.foreign, robot.foreign),
            (&mut self.malformed, robot.malformed),
            (&mut self.own_id, robot.own_id),
            (&mut self.not_kept, robot.not_kept),
            (&mut self.incomplete, robot.incomplete),
            (&mut self.undecided, robot.undecided),
            (&mut self.failed, robot.failed),
        ] {
            *sum += u64::from(count);
        }
        self
    }

    /// Names and counts, in the order of the fields.
    pub fn counts(&self) -> [(&'static str, u64); 7] {
        let Unusable { foreign, malformed, own_id, not_kept, incomplete, undecided, failed } =
            *self;
        [
            ("foreign", foreign),
            ("malformed", malformed),
            ("own_id", own_id),
            ("not_kept", not_kept),
            ("incomplete", incomplete),
            ("undecided", undecided),
            ("failed", failed),
        ]
    }
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
    /// Messages that robots could not use.
    pub unusable: Unusable,
    /// Scripts that have stopped, by time.
    pub faults: Vec<FaultOf>,
    /// Mean, smallest and largest of each quantity of `plot` at the end; the number of a swarm's is all three.
    pub values: Vec<Option<[f64; 3]>>,
}

impl Summary {
    /// Whether every expectation held and no script has stopped.
    pub fn is_success(&self) -> bool {
        let held = |convergence: &Convergence| convergence.verdict == Verdict::Held;
        self.faults.is_empty() && self.convergences.iter().all(held)
    }
}
