//! Range finders: the distance to the first object on a line.

use super::contact::Crowd;
use super::geometry::{Area, Pose};
use super::id::RobotId;
use super::obstacle::Obstacles;
use super::ray::{Ray, Side};

/// The reach of the sensors in mm, as in Bitcraze's model for Gazebo.
const REACH_MM: f32 = 3490.0;

/// The objects that a line of sight can meet.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sight<'a> {
    pub(crate) area: Area,
    pub(crate) obstacles: &'a Obstacles,
    pub(crate) crowd: &'a Crowd,
}

impl Sight<'_> {
    /// Returns the distance in mm from a robot's middle along a ray of the Multi-ranger; `None` if nothing is in reach.
    pub(crate) fn range(&self, robot: RobotId, pose: &Pose, side: Side) -> Option<f32> {
        self.along(robot, pose, Ray::new(pose, side), REACH_MM)
    }

    /// Returns the distance in mm from a robot's middle along a ray, if something is nearer than `reach_mm`.
    pub(crate) fn along(
        &self,
        robot: RobotId,
        pose: &Pose,
        ray: Ray,
        reach_mm: f32,
    ) -> Option<f32> {
        let walls = ray.to_rim(self.area);
        let obstacles = self.obstacles.at(pose.z).filter_map(|obstacle| ray.to_obstacle(obstacle));
        let nearest = walls.into_iter().chain(obstacles).fold(reach_mm, f32::min);
        let nearest = self.crowd.nearest(robot, &ray, pose.z, nearest);
        (nearest < reach_mm).then_some(nearest)
    }
}
