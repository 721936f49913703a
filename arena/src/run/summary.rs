//! The summary of a run.

use std::collections::BTreeMap;

use bittybuzz_vm_core::NetworkCounters;

use crate::engine::WorldStatistics;

use super::expectation::{Convergence, Verdict};
use crate::robot::checks::Findings;
use crate::robot::{FaultCounts, FaultRecord, Overrun, Overruns, ProgramId};

/// The faults of a robot at one place of its script.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FaultOf {
    /// Number of the robot in the scenario.
    pub robot: usize,
    /// The first of these faults, and their count.
    pub record: FaultRecord,
}

/// Steps that robots missed because the previous one took too long, summed over all robots.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct OverrunSummary {
    /// The number of steps that were due while a script still executed the previous one.
    pub missed: u64,
    /// The number of robots that missed a step. A robot counts again after each restart.
    pub robots: usize,
    /// The first overrun, with the number of the robot.
    pub first: Option<(usize, Overrun)>,
}

impl OverrunSummary {
    /// Adds the counts of a robot.
    pub(super) fn add(&mut self, robot: usize, overruns: &Overruns) {
        self.missed += overruns.missed;
        self.robots += 1;
        let is_earlier = |(_, first): &(usize, Overrun)| first.tick <= overruns.first.tick;
        if !self.first.as_ref().is_some_and(is_earlier) {
            self.first = Some((robot, overruns.first.clone()));
        }
    }
}

/// Messages that robots received and could not use, summed over all robots.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Unusable {
    /// Messages of another script.
    pub foreign: u64,
    /// Messages that make no sense.
    pub malformed: u64,
    /// Messages from a robot with the receiver's id.
    pub own_id: u64,
    /// Entries of stigmergies that were passed on but not stored, because there was no room.
    pub not_kept: u64,
    /// Messages of which a fragment was missing.
    pub incomplete: u64,
    /// Conflicts of entries that a handler did not decide.
    pub undecided: u64,
    /// Broadcasts on topics to which the script does not listen.
    pub unwanted: u64,
}

impl Unusable {
    /// Adds the counts of a robot.
    pub(super) fn add(mut self, robot: NetworkCounters, unwanted: u16) -> Self {
        for (sum, count) in [
            (&mut self.foreign, robot.foreign),
            (&mut self.malformed, robot.malformed),
            (&mut self.own_id, robot.own_id),
            (&mut self.not_kept, robot.not_kept),
            (&mut self.incomplete, robot.incomplete),
            (&mut self.undecided, robot.undecided),
            (&mut self.unwanted, unwanted),
        ] {
            *sum += u64::from(count);
        }
        self
    }

    /// Returns names and counts, in the order of the fields.
    pub fn counts(&self) -> [(&'static str, u64); 7] {
        let Unusable { foreign, malformed, own_id, not_kept, incomplete, undecided, unwanted } =
            *self;
        [
            ("foreign", foreign),
            ("malformed", malformed),
            ("own_id", own_id),
            ("not_kept", not_kept),
            ("incomplete", incomplete),
            ("undecided", undecided),
            ("unwanted", unwanted),
        ]
    }
}

/// The results of a run.
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
    pub statistics: WorldStatistics,
    /// Tick of the first crash, and number of the robot in the scenario.
    pub first_crash: Option<(u64, usize)>,
    /// Frames that did not fit into robots' queues: received ones, and those to be sent.
    pub dropped: [u64; 2],
    /// Messages that robots could not use.
    pub unusable: Unusable,
    /// Faults by robot and place, ordered by the time of the first: at most eight places for each
    /// robot.
    pub faults: Vec<FaultOf>,
    /// The counts of all faults.
    pub fault_counts: FaultCounts,
    /// Robots with faults that no expectation counts.
    pub unexpected: usize,
    /// Steps that took longer than the time between two steps.
    pub overruns: OverrunSummary,
    /// Mean, smallest and largest value of each quantity of `plot` at the end. For a measure of the
    /// swarm, all three are the same.
    pub values: Vec<Option<[f64; 3]>>,
    /// The measures of the scenario, in the order of the file. `None` for a time that was not
    /// reached, and for a number that does not exist.
    pub measures: Vec<Option<f64>>,
    /// The results of checks, by program. Only programs that ran in a checked robot are included.
    pub findings: BTreeMap<ProgramId, Findings>,
}

impl Summary {
    /// Returns true if every expectation held and no script had a fault that is not expected.
    pub fn is_success(&self) -> bool {
        let held = |convergence: &Convergence| convergence.verdict == Verdict::Held;
        self.unexpected == 0 && self.convergences.iter().all(held)
    }
}
