//! Obstacles that stand still.

use glam::{Vec2, Vec3, Vec3Swizzles};

use super::half_space::HalfSpace;
use super::segment::LineSegment;

/// Largest number of obstacles that limit one velocity; those that are nearest count.
pub const OBSTACLES_MAX: usize = 8;

/// Halvings of the search for the nearest point: the rest of a segment of 1 m is 15 µm.
const HALVINGS: u32 = 16;

/// A column on the ground that a robot flies around or over. Its ground plan is a rectangle with a rim:
/// a disc has a rectangle without sides, and a thin wall has one side and no rim.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Obstacle {
    /// Middle of the rectangle in m.
    pub center_m: Vec2,
    /// Direction of the first side: a vector of length 1.
    pub along: Vec2,
    /// Half of each side in m, along the direction and across it.
    pub half_m: Vec2,
    /// Width of the rim in m.
    pub rim_m: f32,
    /// Height in m; infinite for a column without end.
    pub top_m: f32,
}

impl Obstacle {
    /// Returns a round column.
    pub fn round(center_m: Vec2, radius_m: f32, top_m: f32) -> Self {
        Obstacle { center_m, along: Vec2::X, half_m: Vec2::ZERO, rim_m: radius_m, top_m }
    }

    /// Returns true if all numbers but the height are finite, no length is negative, and the direction
    /// has length 1.
    pub(super) fn is_valid(&self) -> bool {
        self.center_m.is_finite()
            && self.half_m.is_finite()
            && self.half_m.cmpge(Vec2::ZERO).all()
            && self.rim_m.is_finite()
            && self.rim_m >= 0.0
            && self.along.is_normalized()
            && !self.top_m.is_nan()
    }

    /// Returns a point's place from the middle, along the first side and across it.
    fn local(&self, point_m: Vec3) -> Vec2 {
        Vec2::new(self.along.x, -self.along.y).rotate(point_m.xy() - self.center_m)
    }

    /// Returns the point of the column that is nearest to a point.
    fn nearest(&self, point_m: Vec3) -> Vec3 {
        let local = self.local(point_m);
        let inner = local.clamp(-self.half_m, self.half_m);
        let flat = inner + (local - inner).clamp_length_max(self.rim_m);
        (self.center_m + self.along.rotate(flat)).extend(point_m.z.min(self.top_m))
    }

    /// Returns the square of the distance of a point.
    pub(super) fn distance_squared(&self, point_m: Vec3) -> f32 {
        point_m.distance_squared(self.nearest(point_m))
    }

    /// Returns the way out of the column for a point in it: through the nearest side.
    fn way_out(&self, point_m: Vec3) -> Vec3 {
        let local = self.local(point_m);
        let depth = self.half_m - local.abs();
        let out = if depth.x < depth.y { Vec2::X } else { Vec2::Y };
        self.along.rotate(out * local.signum()).extend(0.0)
    }

    /// Returns the velocities that keep a robot's stopping point `distance_m` away from the column.
    ///
    /// The distance along the segment from the position to the stopping point is a convex function, so
    /// halving finds its minimum. The plane through the column's nearest point there separates the
    /// column from the whole segment.
    pub(super) fn half_space(
        &self,
        own: LineSegment,
        distance_m: f32,
        horizon_s: f32,
    ) -> HalfSpace {
        let way = own.to - own.from;
        let grows = |share: f32| {
            let point = own.from + share * way;
            (point - self.nearest(point)).dot(way) > 0.0
        };
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..HALVINGS {
            let middle = (low + high) / 2.0;
            if grows(middle) {
                high = middle;
            } else {
                low = middle;
            }
        }
        let point = own.from + if grows(high) { low } else { high } * way;
        let nearest = self.nearest(point);
        let away = (point - nearest).try_normalize().unwrap_or_else(|| self.way_out(point));
        let room_m = away.dot(own.to - nearest) - distance_m;
        HalfSpace { normal: -away, bound: room_m / horizon_s }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn obstacle() -> impl Strategy<Value = Obstacle> {
        (
            -1.0f32..1.0,
            -1.0f32..1.0,
            0.0f32..6.3,
            0.0f32..0.8,
            0.0f32..0.8,
            0.0f32..0.5,
            0.3f32..2.0,
        )
            .prop_map(|(x, y, turn, long, wide, rim_m, top_m)| Obstacle {
                center_m: Vec2::new(x, y),
                along: Vec2::from_angle(turn),
                half_m: Vec2::new(long, wide),
                rim_m,
                top_m,
            })
    }

    fn point() -> impl Strategy<Value = Vec3> {
        (-3.0f32..3.0, -3.0f32..3.0, 0.0f32..2.5).prop_map(|(x, y, z)| Vec3::new(x, y, z))
    }

    /// Returns points of the surface: the rim around the rectangle, at all heights.
    fn surface(column: &Obstacle) -> impl Iterator<Item = Vec3> + '_ {
        let turns = (0..24).map(|step| Vec2::from_angle(step as f32 * 0.262));
        let corners = [Vec2::ONE, Vec2::new(1.0, -1.0), Vec2::NEG_ONE, Vec2::new(-1.0, 1.0)];
        let flat = turns.flat_map(move |turn| {
            corners.map(|corner| {
                column.center_m + column.along.rotate(corner * column.half_m + turn * column.rim_m)
            })
        });
        flat.flat_map(move |flat| [0.0, 0.5, 1.0].map(|share| flat.extend(share * column.top_m)))
    }

    proptest! {
        /// A whole segment and the column lie on two sides of the plane, whatever the distance is.
        #[test]
        fn the_plane_separates(column in obstacle(), from in point(), way in point()) {
            let own = LineSegment { from, to: from + way * 0.1 };
            // Points every 0.2 mm or less: the least distance, from 10 mm, is found to 1 um.
            let steps = (0..=2000).map(|step| own.from.lerp(own.to, step as f32 / 2000.0));
            let least = steps.clone().map(|point| column.distance_squared(point)).fold(9.0, f32::min);
            prop_assume!(least > 1e-4);
            let space = column.half_space(own, 0.0, 1.0);
            // A command moves the stopping point: the plane in the room of places.
            let excess = |place: Vec3| space.excess(place - own.to);
            for place in steps {
                prop_assert!(excess(place) < -least.sqrt() + 1e-3, "{}", excess(place));
            }
            for place in surface(&column) {
                prop_assert!(excess(place) > -1e-3, "{place} {}", excess(place));
            }
        }
    }

    #[test]
    fn a_point_in_a_box_leaves_by_the_nearest_side() {
        let column =
            Obstacle { half_m: Vec2::new(1.0, 0.2), ..Obstacle::round(Vec2::ZERO, 0.0, 1.0) };
        let inside = Vec3::new(0.5, -0.15, 0.5);
        let own = LineSegment { from: inside, to: inside };
        let space = column.half_space(own, 0.3, 0.5);
        assert_eq!(space.normal, Vec3::Y);
        assert!((space.bound - -0.6).abs() < 1e-6, "{}", space.bound);
    }

    #[test]
    fn a_robot_above_a_column_is_kept_above_it() {
        let column = Obstacle::round(Vec2::ZERO, 0.3, 1.0);
        let above = Vec3::new(0.1, 0.0, 1.5);
        let space = column.half_space(LineSegment { from: above, to: above }, 0.3, 0.5);
        assert!(space.normal.distance(Vec3::NEG_Z) < 1e-6 && (space.bound - 0.4).abs() < 1e-5);
    }
}
