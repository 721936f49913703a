//! Lines of sight.

use super::geometry::{Area, Pose, direction, turned_back};
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

/// The share by which segments are longer for lines of sight, at their own length as the distance:
/// a few times the rounding error. Else a line through a corner could pass between its two sides.
const ROUNDING: f32 = 1e-6;

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

    /// Returns the line of sight from one place to another, and their distance in mm; `None` if they
    /// coincide.
    pub(crate) fn between(from: (f32, f32), to: (f32, f32)) -> Option<(Self, f32)> {
        let way = (to.0 - from.0, to.1 - from.1);
        let ray = Ray { x: from.0, y: from.1, along: direction(way)? };
        Some((ray, (way.0 * way.0 + way.1 * way.1).sqrt()))
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
        let slack = ROUNDING * (1.0 + (ax.abs() + ay.abs()) / (bx.abs() + by.abs()));
        (distance >= 0.0 && (-slack..=1.0 + slack).contains(&part)).then_some(distance)
    }

    pub(crate) fn to_obstacle(self, obstacle: &Obstacle) -> Option<f32> {
        match *obstacle {
            Obstacle::Segment { from, to } => self.to_segment(from, to),
            Obstacle::Round { x, y, radius } => self.to_disc(x, y, radius),
            Obstacle::Box { x, y, width, height } => {
                Ray { x: self.x - x, y: self.y - y, ..self }.to_box(Area { width, height })
            }
            Obstacle::TurnedBox { x, y, width, height, along } => {
                let (here_x, here_y) = turned_back((self.x - x, self.y - y), along);
                let ray = Ray { x: here_x, y: here_y, along: turned_back(self.along, along) };
                ray.to_box(Area { width, height })
            }
        }
    }

    /// Returns the distance to a rectangle around the origin: 0 from a point inside, `None` if the
    /// line misses it.
    fn to_box(self, area: Area) -> Option<f32> {
        if area.contains(self.x, self.y) { Some(0.0) } else { self.to_rim(area) }
    }

    /// Returns the distance to the nearest side of a rectangle around the origin.
    pub(crate) fn to_rim(self, Area { width, height }: Area) -> Option<f32> {
        let (x, y) = (width / 2.0, height / 2.0);
        let corners = [(x, y), (-x, y), (-x, -y), (x, -y)];
        let sides = [0, 1, 2, 3].map(|i| self.to_segment(corners[i], corners[(i + 1) % 4]));
        sides.into_iter().flatten().reduce(f32::min)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::geometry::turned;
    use crate::engine::stream::Stream;

    fn ray(x: f32, y: f32, degrees: f32) -> Ray {
        Ray::towards(&Pose::new(x, y, 0.0), degrees.to_radians())
    }

    fn turned_box(width: f32, height: f32, degrees: f32) -> Obstacle {
        let (sin, cos) = libm::sincosf(degrees.to_radians());
        Obstacle::TurnedBox { x: 10.0, y: 20.0, width, height, along: (cos, sin) }
    }

    /// A box of 100 mm by 40 mm at (10, 20), whose width rises by 90 degrees: x from -10 to 30, y
    /// from -30 to 70.
    #[test]
    fn distances_to_a_turned_box() {
        let turned = turned_box(100.0, 40.0, 90.0);
        for (ray, expected) in [
            (ray(-60.0, 0.0, 0.0), Some(50.0)),
            (ray(-60.0, 0.0, 180.0), None),
            (ray(-60.0, 71.0, 0.0), None),
            (ray(0.0, -80.0, 90.0), Some(50.0)),
            // 50 mm to the right and up, to the lower left corner.
            (ray(-60.0, -80.0, 45.0), Some(50.0 * core::f32::consts::SQRT_2)),
            // Inside, and on the left side.
            (ray(0.0, 0.0, 123.0), Some(0.0)),
            (ray(-10.0, 0.0, 0.0), Some(0.0)),
        ] {
            let found = ray.to_obstacle(&turned);
            let fits = match (found, expected) {
                (Some(found), Some(expected)) => (found - expected).abs() < 0.001,
                (found, expected) => found == expected,
            };
            assert!(fits, "{ray:?}: {found:?} instead of {expected:?}");
        }
    }

    /// Lines that pass exactly through a corner of a box, of the same box turned, of its sides as
    /// thin walls, and of a room around the observer.
    #[test]
    fn no_line_slips_through_a_corner() {
        let mut stream = Stream::for_brain(1, 1);
        for _ in 0..20_000 {
            let (width, height) = (20.0 + 300.0 * stream.unit(), 20.0 + 300.0 * stream.unit());
            let distance = 10.0 + 1000.0 * stream.unit();
            let degrees = 190.0 + 70.0 * stream.unit();
            let start = |corner: (f32, f32), turn: f32| {
                let way = ray(corner.0, corner.1, degrees + turn);
                let (x, y) = way.at(-distance);
                Ray { x, y, ..way }
            };
            let corner = (width / 2.0, height / 2.0);
            let straight = Obstacle::Box { x: 0.0, y: 0.0, width, height };
            let of_box = start(corner, 0.0).to_obstacle(&straight);

            let turn = 360.0 * stream.unit();
            let (sin, cos) = libm::sincosf(turn.to_radians());
            let (x, y) = turned(corner, (cos, sin));
            let aslant = turned_box(width, height, turn);
            let of_turned = start((10.0 + x, 20.0 + y), turn).to_obstacle(&aslant);

            let sides = [(-width / 2.0, corner.1), (corner.0, -height / 2.0)];
            let walls = sides.map(|from| Obstacle::Segment { from, to: corner });
            let of_walls = walls.map(|wall| start(corner, 0.0).to_obstacle(&wall));
            let nearest = of_walls.into_iter().flatten().reduce(f32::min);

            let inside = distance.min(0.9 * width.min(height));
            let way = ray(corner.0, corner.1, degrees);
            let (x, y) = way.at(inside);
            let room = Ray { x, y, along: (-way.along.0, -way.along.1) };
            let of_room = room.to_rim(Area { width, height });

            for (found, expected) in
                [(of_box, distance), (of_turned, distance), (nearest, distance), (of_room, inside)]
            {
                let found = found.unwrap_or(f32::INFINITY);
                assert!((found - expected).abs() < 0.01, "{found} instead of {expected}");
            }
        }
    }
}
