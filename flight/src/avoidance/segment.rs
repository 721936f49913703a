//! The shortest connection between two line segments.

use glam::Vec3;

/// A line segment between two points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LineSegment {
    pub from: Vec3,
    pub to: Vec3,
}

/// Returns the two nearest points of two segments, the first one's point first.
///
/// The squared distance is a convex quadratic function of the two positions along the segments, so
/// its minimum over the unit square follows from the free minimum in one position, and clamping
/// (Ericson 2005, "Real-Time Collision Detection", section 5.1.9). A segment may be a point.
pub(super) fn nearest_points(first: LineSegment, second: LineSegment) -> (Vec3, Vec3) {
    let (along_first, along_second) = (first.to - first.from, second.to - second.from);
    let offset = first.from - second.from;
    let (square_first, square_second) =
        (along_first.length_squared(), along_second.length_squared());
    let product = along_first.dot(along_second);
    let (offset_first, offset_second) = (along_first.dot(offset), along_second.dot(offset));
    let determinant = square_first * square_second - product * product;
    // Parallel segments have many nearest pairs; the start of the first one is as good as others.
    let is_parallel = determinant <= 1e-6 * square_first * square_second;
    let free = if is_parallel {
        0.0
    } else {
        ((product * offset_second - offset_first * square_second) / determinant).clamp(0.0, 1.0)
    };
    let on_second = unit_ratio(product * free + offset_second, square_second);
    let on_first = unit_ratio(product * on_second - offset_first, square_first);
    (first.from + on_first * along_first, second.from + on_second * along_second)
}

/// Divides and limits to 0 to 1; the ratio of a segment without length is 0.
fn unit_ratio(value: f32, square: f32) -> f32 {
    if square > 0.0 { (value / square).clamp(0.0, 1.0) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn point() -> impl Strategy<Value = Vec3> {
        (-2.0f32..2.0, -2.0f32..2.0, -2.0f32..2.0).prop_map(|(x, y, z)| Vec3::new(x, y, z))
    }

    fn segment() -> impl Strategy<Value = LineSegment> {
        (point(), point()).prop_map(|(from, to)| LineSegment { from, to })
    }

    proptest! {
        #[test]
        fn no_sampled_pair_is_nearer(first in segment(), second in segment()) {
            let (a, b) = nearest_points(first, second);
            let on = |s: LineSegment, i: i32| s.from.lerp(s.to, i as f32 / 50.0);
            for i in 0..=50 {
                for k in 0..=50 {
                    let sampled = on(first, i).distance(on(second, k));
                    prop_assert!(a.distance(b) <= sampled + 1e-4);
                }
            }
        }
    }

    #[test]
    fn points_and_parallel_segments_are_handled() {
        let point = LineSegment { from: Vec3::Y, to: Vec3::Y };
        assert_eq!(nearest_points(point, point), (Vec3::Y, Vec3::Y));
        let x = LineSegment { from: Vec3::ZERO, to: Vec3::X };
        assert_eq!(nearest_points(x, point), (Vec3::ZERO, Vec3::Y));
        let above = LineSegment { from: Vec3::new(3.0, 1.0, 0.0), to: Vec3::new(0.5, 1.0, 0.0) };
        let (a, b) = nearest_points(x, above);
        assert!((a.distance(b) - 1.0).abs() < 1e-6);
    }
}
