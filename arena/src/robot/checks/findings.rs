//! The results of checks, of one robot or of several.

use std::collections::BTreeMap;

use bittybuzz_vm_core::number::Number;

use super::operation::{Anomaly, Exact, Operation};

/// A robot and a time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct RobotMoment {
    /// Tick of the world, or step of a script that runs alone.
    pub tick: u64,
    /// Id of the robot.
    pub robot: u16,
}

/// An operation that went wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FailedOperation {
    pub operation: Operation,
    /// The mathematical result.
    pub exact: Exact,
    /// The result of the machine.
    pub result: Number,
    pub at: RobotMoment,
}

/// The anomalies of one kind at one place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Occurrences {
    pub count: u64,
    /// The first occurrence. If several robots have one in the same tick, that with the lowest id.
    pub first: FailedOperation,
}

/// The highest value of a quantity, and the first time at which it was reached.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Peak {
    pub value: usize,
    pub at: RobotMoment,
}

/// Cycles of steps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StepCosts {
    /// Steps that were completed.
    pub steps: u64,
    /// Cycles of all of them.
    pub cycles: u64,
    /// Cycles of the longest step, and the time when it was completed.
    pub longest: Option<(u64, RobotMoment)>,
}

/// The results of checks.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Findings {
    /// Anomalies by the last byte of their instruction, as an offset from the start of the code.
    pub places: BTreeMap<(u16, Anomaly), Occurrences>,
    /// Slots that globals, frames and reachable values of the heap took.
    pub slots: Option<Peak>,
    /// Nested calls of functions of the script.
    pub calls: Option<Peak>,
    /// Entries of stigmergies.
    pub entries: Option<Peak>,
    /// Cycles of steps; none without a table of costs.
    pub steps: StepCosts,
}

impl Findings {
    /// Adds an anomaly.
    pub(super) fn add(&mut self, position: u16, anomaly: Anomaly, example: FailedOperation) {
        let none = Occurrences { count: 0, first: example };
        self.places.entry((position, anomaly)).or_insert(none).count += 1;
    }

    /// Adds the findings of another robot of the same group.
    pub fn merge(&mut self, other: &Findings) {
        for (place, found) in &other.places {
            let known = self.places.entry(*place).or_insert(Occurrences { count: 0, ..*found });
            known.count += found.count;
            if found.first.at < known.first.at {
                known.first = found.first;
            }
        }
        for (known, peak) in [
            (&mut self.slots, other.slots),
            (&mut self.calls, other.calls),
            (&mut self.entries, other.entries),
        ] {
            if let Some(peak) = peak {
                raise(known, peak);
            }
        }
        self.steps.steps += other.steps.steps;
        self.steps.cycles += other.steps.cycles;
        if let Some((cycles, at)) = other.steps.longest {
            self.steps.note_longest(cycles, at);
        }
    }
}

impl StepCosts {
    /// Adds a step.
    pub(super) fn add(&mut self, cycles: u64, at: RobotMoment) {
        self.steps += 1;
        self.cycles += cycles;
        self.note_longest(cycles, at);
    }

    fn note_longest(&mut self, cycles: u64, at: RobotMoment) {
        let is_longer =
            |(known, since): (u64, RobotMoment)| cycles > known || cycles == known && at < since;
        if self.longest.is_none_or(is_longer) {
            self.longest = Some((cycles, at));
        }
    }
}

/// Keeps the higher of two peaks, or the earlier one.
pub(super) fn raise(known: &mut Option<Peak>, peak: Peak) {
    let is_higher =
        |old: Peak| peak.value > old.value || peak.value == old.value && peak.at < old.at;
    if known.is_none_or(is_higher) {
        *known = Some(peak);
    }
}
