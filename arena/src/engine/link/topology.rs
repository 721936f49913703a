//! Blocked links, partitions and walls, which cut robots off from each other.

use std::collections::BTreeSet;

use super::Medium;
use crate::engine::id::RobotId;
use crate::engine::shadow::Shadows;

/// The barriers between robots that events set. Two robots that are cut off neither receive,
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

/// All barriers between robots: those of the topology, and the walls.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Barriers<'a> {
    pub(crate) topology: &'a Topology,
    pub(crate) shadows: Shadows<'a>,
}

impl Barriers<'_> {
    /// Returns true if frames of a medium pass between two robots at these places that are near
    /// enough. Infrared is reflected by the ground, so any wall that is higher than the lower robot
    /// stands blocks it.
    pub(crate) fn connect(
        &self,
        medium: Medium,
        a: RobotId,
        [x, y, z]: [f32; 3],
        b: RobotId,
        [to_x, to_y, to_z]: [f32; 3],
    ) -> bool {
        self.topology.connects(a, b)
            && !(medium == Medium::Infrared
                && self.shadows.separate((x, y), (to_x, to_y), z.min(to_z)))
    }
}
