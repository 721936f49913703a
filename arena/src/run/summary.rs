//! The summary of a run.

use std::collections::BTreeMap;

use bittybuzz_vm_core::Counters;

use crate::engine::Statistics;

use super::expectation::{Convergence, Verdict};
use crate::robot::checks::Findings;
use crate::robot::{FaultCounts, FaultRecord, Overrun, Overruns, ProgramId};

/// The faults of a robot at one place of its script.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FaultOf {
    /// Number of the robot in the scenario.
    pub robot: usize,
    /// The first of them, and their count.
    pub record: FaultRecord,
}

/// Steps that robots missed because the ones before took too long, all robots together.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct OverrunSummary {
    /// Steps that were due while a script still executed the one before.
    pub missed: u64,
    /// Robots that missed a step. One that was switched off and on counts once for each time.
    pub robots: usize,
    /// The first of them: number of the robot, and its first missed step.
    pub first: Option<(usize, Overrun)>,
}

impl OverrunSummary {
    /// Adds those of a robot.
    pub(super) fn add(&mut self, robot: usize, overruns: &Overruns) {
        self.missed += overruns.missed;
        self.robots += 1;
        let is_earlier = |(_, first): &(usize, Overrun)| first.tick <= overruns.first.tick;
        if !self.first.as_ref().is_some_and(is_earlier) {
            self.first = Some((robot, overruns.first.clone()));
        }
    }
}

/// Messages that robots heard and could not use, all robots together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Unusable {
    /// Messages of another script.
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
        ] {
            *sum += u64::from(count);
        }
        self
    }

    /// Names and counts, in the order of the fields.
    pub fn counts(&self) -> [(&'static str, u64); 6] {
        let Unusable { foreign, malformed, own_id, not_kept, incomplete, undecided } = *self;
        [
            ("foreign", foreign),
            ("malformed", malformed),
            ("own_id", own_id),
            ("not_kept", not_kept),
            ("incomplete", incomplete),
            ("undecided", undecided),
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
    /// The outcomes of the expectations, in the order of the file.
    pub convergences: Vec<Convergence>,
    /// Frames, contacts and crashes.
    pub statistics: Statistics,
    /// Tick of the first crash, and number of the robot in the scenario.
    pub first_crash: Option<(u64, usize)>,
    /// Frames that robots' queues had no room for: heard, and to be sent.
    pub dropped: [u64; 2],
    /// Messages that robots could not use.
    pub unusable: Unusable,
    /// Places of faults, by the time of the first: at most eight of each robot.
    pub faults: Vec<FaultOf>,
    /// The numbers of all faults.
    pub fault_counts: FaultCounts,
    /// Robots with faults that no expectation counts.
    pub unexpected: usize,
    /// Steps that took longer than the time between two steps.
    pub overruns: OverrunSummary,
    /// Mean, smallest and largest of each quantity of `plot` at the end; the number of a swarm's is all three.
    pub values: Vec<Option<[f64; 3]>>,
    /// The results of checks, by program: of those that ran in a robot that was checked.
    pub findings: BTreeMap<ProgramId, Findings>,
}

impl Summary {
    /// Returns true if every expectation held and no script had a fault that is not expected.
    pub fn is_success(&self) -> bool {
        let held = |convergence: &Convergence| convergence.verdict == Verdict::Held;
        self.unexpected == 0 && self.convergences.iter().all(held)
    }
}
