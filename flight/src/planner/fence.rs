//! A box that the reference never leaves.

use glam::Vec3;

/// Distance in m by which rounding may place a point outside, before it is clamped.
const ROUNDING_M: f32 = 1e-4;

/// A box in the world frame, with a lower corner that is nowhere above the upper one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PositionFence {
    least_m: Vec3,
    most_m: Vec3,
}

impl PositionFence {
    /// A box with sides of 2 km, for flights without a fence. An `f32` resolves 0.06 mm at 1 km.
    pub const WIDE: Self = PositionFence { least_m: Vec3::splat(-1e3), most_m: Vec3::splat(1e3) };

    /// Returns the box between two corners, in m.
    ///
    /// Returns `None` if a number is not finite or a coordinate of `least_m` exceeds `most_m`.
    pub fn new(least_m: Vec3, most_m: Vec3) -> Option<Self> {
        let is_valid = least_m.is_finite() && most_m.is_finite() && least_m.cmple(most_m).all();
        is_valid.then_some(PositionFence { least_m, most_m })
    }

    /// Returns the lower corner in m.
    pub fn least_m(&self) -> Vec3 {
        self.least_m
    }

    /// Returns the upper corner in m.
    pub fn most_m(&self) -> Vec3 {
        self.most_m
    }

    /// Returns true if the point is in the box or on its surface.
    pub fn contains(&self, point_m: Vec3) -> bool {
        point_m.cmpge(self.least_m).all() && point_m.cmple(self.most_m).all()
    }

    /// Returns the point of the box that is closest to `point_m`.
    pub fn clamp(&self, point_m: Vec3) -> Vec3 {
        point_m.max(self.least_m).min(self.most_m)
    }

    /// Returns true if the point is in the box, or so close to it that only rounding explains it.
    pub(super) fn nearly_contains(&self, point_m: Vec3) -> bool {
        (self.clamp(point_m) - point_m).abs().max_element() <= ROUNDING_M
    }

    /// Returns the smallest box that contains this box and a finite point.
    pub(super) fn extended_to(&self, point_m: Vec3) -> Self {
        PositionFence { least_m: self.least_m.min(point_m), most_m: self.most_m.max(point_m) }
    }

    /// Returns this box, extended in height alone to contain the height of a finite point.
    pub(super) fn extended_to_height(&self, height_m: f32) -> Self {
        let mut extended = *self;
        extended.least_m.z = extended.least_m.z.min(height_m);
        extended.most_m.z = extended.most_m.z.max(height_m);
        extended
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn refuses_corners_that_make_no_box() {
        assert_eq!(PositionFence::new(Vec3::ONE, Vec3::ZERO), None);
        assert_eq!(PositionFence::new(Vec3::ZERO, Vec3::new(1.0, -0.1, 1.0)), None);
        assert_eq!(PositionFence::new(Vec3::NAN, Vec3::ONE), None);
        assert_eq!(PositionFence::new(Vec3::ZERO, Vec3::INFINITY), None);
        assert!(PositionFence::new(Vec3::ONE, Vec3::ONE).is_some());
    }

    proptest! {
        #[test]
        fn clamped_point_is_inside_and_moves_no_point_that_was(
            x in -9.0_f32..9.0, y in -9.0_f32..9.0, z in -9.0_f32..9.0,
        ) {
            let fence = PositionFence::new(Vec3::new(-3.0, -1.0, 0.0), Vec3::splat(2.0)).unwrap();
            let point = Vec3::new(x, y, z);
            prop_assert!(fence.contains(fence.clamp(point)));
            prop_assert_eq!(fence.contains(point), fence.clamp(point) == point);
            prop_assert!(fence.extended_to(point).contains(point));
        }
    }
}
