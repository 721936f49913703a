//! Blocked links and partitions, which cut robots off from each other.

use std::collections::BTreeSet;

use crate::engine::id::RobotId;

/// The barriers between robots, apart from distance. Two robots that are cut off neither receive,
/// disturb nor sense each other.
#[derive(Clone, Debug, Default)]
pub(crate) struct Topology {
    blocked: BTreeSet<(RobotId, RobotId)>,
    /// The group of each robot; empty without a partition.
    groups: Vec<u8>,
}

impl Topology {
    pub(crate) fn block(&mut self, a: RobotId, b: RobotId) {
        self.blocked.insert((a.min(b), a.max(b)));
    }

    pub(crate) fn unblock(&mut self, a: RobotId, b: RobotId) {
        self.blocked.remove(&(a.min(b), a.max(b)));
    }

    pub(crate) fn partition(&mut self, groups: Vec<u8>) {
        self.groups = groups;
    }

    pub(crate) fn heal(&mut self) {
        self.groups.clear();
    }

    /// Returns true if frames pass between two robots that are near enough.
    pub(crate) fn connects(&self, a: RobotId, b: RobotId) -> bool {
        (self.groups.is_empty() || self.group(a) == self.group(b))
            && (self.blocked.is_empty() || !self.blocked.contains(&(a.min(b), a.max(b))))
    }

    /// Returns the group of a robot: 0 for one that joined after the partition, and for an intruder.
    fn group(&self, robot: RobotId) -> u8 {
        self.groups.get(usize::from(robot.0)).copied().unwrap_or(0)
    }
}
