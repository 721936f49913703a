//! Counters since the world began.

use super::id::RobotId;
use super::link::Medium;

/// Counts of one medium. The fate of a frame counts once for every robot within range.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct LinkStatistics {
    /// Frames that were sent.
    pub sent: u64,
    /// The number of times that a robot wanted to send and found the channel busy.
    pub postponed: u64,
    /// Frames that arrived at a robot.
    pub received: u64,
    /// Frames that overlapped with another one at a robot.
    pub collided: u64,
    /// Frames that a robot missed because it was sending.
    pub deaf: u64,
    /// Frames lost by chance on the way to a robot.
    pub lost: u64,
    /// Second copies that arrived (an option for tests).
    pub duplicated: u64,
    /// Frames that were held back, so that others overtook them (an option for tests).
    pub delayed: u64,
}

/// Counts of the whole world.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct WorldStatistics {
    /// The number of times that a robot without contact began to touch another.
    pub contacts: u64,
    /// Robot-ticks in touch with another robot.
    pub contact_ticks: u64,
    /// Robot-ticks in touch with a wall or an obstacle.
    pub wall_ticks: u64,
    /// Crashes of bodies that fly.
    pub crashes: u64,
    /// Tick and robot of the first crash.
    pub first_crash: Option<(u64, RobotId)>,
    pub(crate) links: [LinkStatistics; Medium::COUNT],
}

impl WorldStatistics {
    /// Returns the counts of one medium.
    #[must_use]
    pub fn link(&self, medium: Medium) -> &LinkStatistics {
        &self.links[medium as usize]
    }

    /// Adds the counts of links outside of the engine.
    pub(crate) fn add(&mut self, medium: Medium, counted: &LinkStatistics) {
        self.links[medium as usize].add(counted);
    }

    /// Returns the sum of the counts of all media.
    #[must_use]
    pub fn all_links(&self) -> LinkStatistics {
        let mut sum = LinkStatistics::default();
        for link in &self.links {
            sum.add(link);
        }
        sum
    }
}

impl LinkStatistics {
    pub(crate) fn add(&mut self, other: &LinkStatistics) {
        self.sent += other.sent;
        self.postponed += other.postponed;
        self.received += other.received;
        self.collided += other.collided;
        self.deaf += other.deaf;
        self.lost += other.lost;
        self.duplicated += other.duplicated;
        self.delayed += other.delayed;
    }
}
