//! Lines of sight.

use super::geometry::{Area, Pose};
use super::obstacle::Obstacle;

/// The direction of a range finder of the Multi-ranger deck.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Along the heading.
    Front,
    /// A quarter turn anticlockwise from the heading.
    Left,
    /// Opposite to the heading.
    Back,
    /// A quarter turn clockwise from the heading.
    Right,
}

/// A line of sight from a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ray {
    x: f32,
    y: f32,
    /// Direction, of length 1.
    along: (f32, f32),
}

impl Ray {
    /// Returns the line of sight in a direction relative to the heading, in radians.
    pub(crate) fn towards(pose: &Pose, direction_rad: f32) -> Self {
        let (sin, cos) = libm::sincosf(pose.heading + direction_rad);
        Ray { x: pose.x, y: pose.y, along: (cos, sin) }
    }

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

    /// Returns the point at a distance along the line.
    pub(crate) fn at(&self, distance_mm: f32) -> (f32, f32) {
        (self.x + distance_mm * self.along.0, self.y + distance_mm * self.along.1)
    }

    /// Returns the distance to a disc: 0 from a point inside, `None` if the line misses the disc.
    pub(crate) fn to_disc(self, x: f32, y: f32, radius_mm: f32) -> Option<f32> {
        let (dx, dy) = (x - self.x, y - self.y);
        let ahead = dx * self.along.0 + dy * self.along.1;
        let offset = dx * self.along.1 - dy * self.along.0;
        let half = radius_mm * radius_mm - offset * offset;
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

    pub(crate) fn to_obstacle(self, obstacle: &Obstacle) -> Option<f32> {
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

    /// Returns the distance to the nearest side of a rectangle around the origin.
    pub(crate) fn to_rim(self, Area { width, height }: Area) -> Option<f32> {
        let (x, y) = (width / 2.0, height / 2.0);
        let corners = [(x, y), (-x, y), (-x, -y), (x, -y)];
        let sides = [0, 1, 2, 3].map(|i| self.to_segment(corners[i], corners[(i + 1) % 4]));
        sides.into_iter().flatten().reduce(f32::min)
    }
}
