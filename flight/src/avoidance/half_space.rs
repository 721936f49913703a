//! The nearest point of an intersection of half-spaces in three dimensions.
//!
//! The search adds one half-space after another (Seidel 1991, "Small-dimensional linear programming
//! and convex hulls made easy"; de Berg et al. 2008, "Computational Geometry", section 4.4). If the
//! nearest point so far violates a new half-space, the new nearest point lies on its plane. So the
//! same search runs in that plane, then on a line. The answer is exact, without iterations and step
//! sizes. The cost is O(n) if few half-spaces matter and O(n³) at worst.

use glam::Vec3;

/// Largest excess over a bound that counts as satisfied. It covers the rounding of f32 at
/// velocities of some m/s.
const TOLERANCE: f32 = 1e-5;

/// Smallest sine of the angle between two planes that intersect in a line.
const SINE_MIN: f32 = 1e-3;

/// All points v with `normal`·v ≤ `bound`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct HalfSpace {
    /// Unit vector that points out of the half-space.
    pub normal: Vec3,
    pub bound: f32,
}

impl HalfSpace {
    /// Returns the distance of a point from the half-space, negative inside.
    pub fn excess(&self, point: Vec3) -> f32 {
        self.normal.dot(point) - self.bound
    }

    fn is_violated_by(&self, point: Vec3) -> bool {
        self.excess(point) > TOLERANCE
    }
}

/// Returns the point of all half-spaces that is nearest to `wanted`, or `None` if they have no
/// common point.
pub(super) fn nearest_point(
    spaces: impl Iterator<Item = HalfSpace> + Clone,
    wanted: Vec3,
) -> Option<Vec3> {
    let mut point = wanted;
    for (index, space) in spaces.clone().enumerate() {
        if space.is_violated_by(point) {
            point = nearest_on_plane(spaces.clone().take(index), space, wanted)?;
        }
    }
    Some(point)
}

fn nearest_on_plane(
    spaces: impl Iterator<Item = HalfSpace> + Clone,
    plane: HalfSpace,
    wanted: Vec3,
) -> Option<Vec3> {
    let foot = wanted - plane.excess(wanted) * plane.normal;
    let mut point = foot;
    for (index, space) in spaces.clone().enumerate() {
        if space.is_violated_by(point) {
            point = nearest_on_line(spaces.clone().take(index), plane, space, foot)?;
        }
    }
    Some(point)
}

/// Searches the line where the surfaces of `plane` and `other` intersect, for the point nearest to
/// `foot`, a point of `plane`.
fn nearest_on_line(
    spaces: impl Iterator<Item = HalfSpace>,
    plane: HalfSpace,
    other: HalfSpace,
    foot: Vec3,
) -> Option<Vec3> {
    let cross = plane.normal.cross(other.normal);
    let sine = cross.length();
    if sine < SINE_MIN {
        return None;
    }
    let along = cross / sine;
    // `toward` lies in the plane and is perpendicular to the line; its product with the other
    // normal is the sine. So the foot moves in the plane, which stays exact for small angles.
    let toward = along.cross(plane.normal);
    let start = foot - other.excess(foot) / sine * toward;
    let (mut low, mut high) = (f32::NEG_INFINITY, f32::INFINITY);
    for space in spaces {
        let slope = space.normal.dot(along);
        let room = -space.excess(start);
        if slope > SINE_MIN {
            high = high.min(room / slope);
        } else if slope < -SINE_MIN {
            low = low.max(room / slope);
        } else if room < -TOLERANCE {
            return None;
        }
    }
    (low <= high + TOLERANCE).then(|| start + 0.0f32.max(low).min(high) * along)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
        a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    }

    /// Returns a + factor·b.
    fn add(a: [f64; 3], factor: f64, b: [f64; 3]) -> [f64; 3] {
        [a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]]
    }

    fn wide(v: Vec3) -> [f64; 3] {
        v.to_array().map(f64::from)
    }

    fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
        let way = add(a, -1.0, b);
        dot(way, way).sqrt()
    }

    /// Projects with f64 by the method of Dykstra (Boyle and Dykstra 1986), which converges to the
    /// nearest point of an intersection that is not empty.
    fn dykstra(spaces: &[HalfSpace], wanted: Vec3) -> [f64; 3] {
        let mut point = wide(wanted);
        // The correction of a half-space is a multiple of its normal.
        let mut corrections: Vec<f64> = spaces.iter().map(|_| 0.0).collect();
        for _ in 0..5000 {
            for (space, correction) in spaces.iter().zip(&mut corrections) {
                let normal = wide(space.normal);
                let start = add(point, *correction, normal);
                *correction = (dot(normal, start) - f64::from(space.bound)).max(0.0);
                point = add(start, -*correction, normal);
            }
        }
        point
    }

    fn unit() -> impl Strategy<Value = Vec3> {
        vector(1.0).prop_filter_map("length", |v| (v.length() > 0.1).then(|| v / v.length()))
    }

    fn vector(most: f32) -> impl Strategy<Value = Vec3> {
        (-most..most, -most..most, -most..most).prop_map(|(x, y, z)| Vec3::new(x, y, z))
    }

    fn half_spaces(bounds: core::ops::Range<f32>) -> impl Strategy<Value = Vec<HalfSpace>> {
        let half_space = (unit(), bounds).prop_map(|(normal, bound)| HalfSpace { normal, bound });
        proptest::collection::vec(half_space, 0..=16)
    }

    proptest! {
        #[test]
        fn agrees_with_dykstra_where_the_origin_is_allowed(
            spaces in half_spaces(0.0..0.5), wanted in vector(1.0)
        ) {
            let found = nearest_point(spaces.iter().copied(), wanted);
            prop_assert!(found.is_some());
            let found = found.unwrap();
            for space in &spaces {
                prop_assert!(space.excess(found) < 1e-4, "{} > 0", space.excess(found));
            }
            let best = dykstra(&spaces, wanted);
            let far = distance(wide(found), wide(wanted));
            prop_assert!(far <= distance(best, wide(wanted)) + 2e-3, "{found} not {best:?}");
            // A projection onto a convex set with the origin never gets longer.
            prop_assert!(found.length() <= wanted.length() + 1e-4);
        }

        #[test]
        fn finds_a_point_exactly_if_one_exists(
            spaces in half_spaces(-0.3..0.5), wanted in vector(1.0)
        ) {
            let best = dykstra(&spaces, wanted);
            let excess = spaces.iter().map(|s| dot(wide(s.normal), best) - f64::from(s.bound));
            let excess = excess.fold(f64::NEG_INFINITY, f64::max);
            match nearest_point(spaces.iter().copied(), wanted) {
                Some(found) => for space in &spaces {
                    prop_assert!(space.excess(found) < 1e-4, "{} > 0", space.excess(found));
                },
                None => prop_assert!(excess > -1e-3, "{best:?} satisfies all by {excess}"),
            }
        }
    }

    #[test]
    fn an_empty_slab_has_no_point() {
        let slab = [
            HalfSpace { normal: Vec3::X, bound: -0.1 },
            HalfSpace { normal: Vec3::NEG_X, bound: -0.1 },
        ];
        assert_eq!(nearest_point(slab.into_iter(), Vec3::Y), None);
    }

    #[test]
    fn a_corner_is_found() {
        let corner = [Vec3::X, Vec3::Y, Vec3::Z].map(|normal| HalfSpace { normal, bound: 0.1 });
        let found = nearest_point(corner.into_iter(), Vec3::splat(0.5)).unwrap();
        assert!(found.distance(Vec3::splat(0.1)) < 1e-6);
    }
}
