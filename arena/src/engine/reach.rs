//! The robots that a robot's frames reach.

use super::brain::Brain;
use super::geometry::Pose;
use super::herd::Herd;
use super::id::RobotId;
use super::link::Barriers;
use super::shadow::Shadows;
use super::world::World;

impl<B: Brain> World<B> {
    /// Returns the reach of a robot's frames in mm, measured between the middles of two robots; 0
    /// if there is no such robot.
    #[must_use]
    pub fn reach_mm(&self, id: RobotId) -> f64 {
        let Ok(index) = self.index(id) else { return 0.0 };
        let Herd { medium, link, .. } = self.herd_of(index);
        f64::from(self.air[*medium as usize].reach_mm(*link))
    }

    /// Returns true if frames of the sender reach the receiver: both use the same medium, they are
    /// near enough, and they are not cut off from each other.
    #[must_use]
    pub fn can_receive(&self, receiver: RobotId, sender: RobotId) -> bool {
        let (Ok(to), Ok(from)) = (self.index(receiver), self.index(sender)) else { return false };
        let (here, there) = (self.poses[to], self.poses[from]);
        let [dx, dy, dz] = [here.x - there.x, here.y - there.y, here.z - there.z].map(f64::from);
        let reach = self.reach_mm(sender);
        self.herd_of(to).medium == self.herd_of(from).medium
            && dx * dx + dy * dy + dz * dz <= reach * reach
            && self.connects(receiver, sender)
    }

    /// Returns true if two robots are not cut off from each other, whatever their distance: by an
    /// event, or by a wall between robots that send infrared.
    #[must_use]
    pub fn connects(&self, a: RobotId, b: RobotId) -> bool {
        let (Ok(one), Ok(other)) = (self.index(a), self.index(b)) else { return true };
        let [here, there] = [one, other].map(|index| {
            let Pose { x, y, z, .. } = self.poses[index];
            [x, y, z]
        });
        let barriers = Barriers { topology: &self.topology, shadows: self.shadows() };
        barriers.connect(self.herd_of(one).medium, a, here, b, there)
    }

    /// Returns true if the world has walls, obstacles or movable discs.
    #[must_use]
    pub fn has_walls(&self) -> bool {
        !self.shadows().is_empty()
    }

    pub(crate) fn shadows(&self) -> Shadows<'_> {
        Shadows { obstacles: &self.obstacles, movables: &self.crowd.movables }
    }
}
