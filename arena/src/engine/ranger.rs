//! Range finders: what lies on a line, and how far.

use super::contact::Crowd;
use super::geometry::{Area, Pose};
use super::obstacle::{Obstacle, Obstacles};
use super::robot::RobotId;

/// Where a range finder of the Multi-ranger deck looks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Along the heading.
    Front,
    /// A quarter turn anticlockwise of it.
    Left,
    /// Against it.
    Back,
    /// A quarter turn clockwise of it.
    Right,
}

/// mm that the sensors reach, as Bitcraze's model for Gazebo has them.
const REACH: f32 = 3490.0;

/// A line of sight from a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ray {
    x: f32,
    y: f32,
    /// Direction, of length 1.
    along: (f32, f32),
}

impl Ray {
    pub(crate) fn new(pose: &Pose, side: Side) -> Self {
        let (sin, cos) = libm::sincosf(pose.heading);
        let along = match side {
            Side::Front => (cos, sin),
            Side::Left => (-sin, cos),
            Side::Back => (-cos, -sin),
            Side::Right => (sin, -cos),
        };
        Ray { x: pose.x, y: pose.y, along }
    }

    /// The point so far along.
    pub(crate) fn at(&self, distance: f32) -> (f32, f32) {
        (self.x + distance * self.along.0, self.y + distance * self.along.1)
    }

    /// How far a disc is; a point inside sees it at 0.
    pub(crate) fn to_disc(self, x: f32, y: f32, radius: f32) -> Option<f32> {
        let (dx, dy) = (x - self.x, y - self.y);
        let ahead = dx * self.along.0 + dy * self.along.1;
        let beside = dx * self.along.1 - dy * self.along.0;
        let half = radius * radius - beside * beside;
        if half < 0.0 || ahead + half.sqrt() < 0.0 {
            return None;
        }
        Some((ahead - half.sqrt()).max(0.0))
    }

    fn to_segment(self, from: (f32, f32), to: (f32, f32)) -> Option<f32> {
        let (ax, ay) = (from.0 - self.x, from.1 - self.y);
        let (bx, by) = (to.0 - from.0, to.1 - from.1);
        let across = self.along.0 * by - self.along.1 * bx;
        if across == 0.0 {
            return None;
        }
        let distance = (ax * by - ay * bx) / across;
        let part = (ax * self.along.1 - ay * self.along.0) / across;
        (distance >= 0.0 && (0.0..=1.0).contains(&part)).then_some(distance)
    }

    fn to_obstacle(self, obstacle: &Obstacle) -> Option<f32> {
        match *obstacle {
            Obstacle::Segment { from, to } => self.to_segment(from, to),
            Obstacle::Round { x, y, radius } => self.to_disc(x, y, radius),
            Obstacle::Box { x, y, width, height } => {
                let area = Area { width, height };
                let moved = Ray { x: self.x - x, y: self.y - y, ..self };
                if area.contains(moved.x, moved.y) { Some(0.0) } else { moved.to_rim(area) }
            }
        }
    }

    /// How far the nearest side of a rectangle around the origin is.
    fn to_rim(self, Area { width, height }: Area) -> Option<f32> {
        let (x, y) = (width / 2.0, height / 2.0);
        let corners = [(x, y), (-x, y), (-x, -y), (x, -y)];
        let sides = [0, 1, 2, 3].map(|i| self.to_segment(corners[i], corners[(i + 1) % 4]));
        sides.into_iter().flatten().reduce(f32::min)
    }
}

/// Everything that a line of sight can meet.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sight<'a> {
    pub(crate) area: Area,
    pub(crate) obstacles: &'a Obstacles,
    pub(crate) crowd: &'a Crowd,
}

impl Sight<'_> {
    /// Distance in mm from a robot's middle to what it sees; `None` if nothing is in reach.
    pub(crate) fn range(&self, robot: RobotId, pose: &Pose, side: Side) -> Option<f32> {
        let ray = Ray::new(pose, side);
        let walls = ray.to_rim(self.area);
        let obstacles =
            self.obstacles.all().iter().filter_map(|obstacle| ray.to_obstacle(obstacle));
        let nearest = walls.into_iter().chain(obstacles).fold(REACH, f32::min);
        let nearest = self.crowd.nearest(robot, &ray, pose.z, nearest);
        (nearest < REACH).then_some(nearest)
    }
}
