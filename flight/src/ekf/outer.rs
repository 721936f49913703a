//! The acceleration by an outer force along body x and y, such as wind or a touch.
//!
//! Thrust does not act along these axes, so the accelerometer shows there the force that drag does not
//! explain. Vibration and the sensor's offset hide a small force, and a filter without knowledge of
//! a large one takes it for a tilt: the accelerometer therefore counts the more, the larger the
//! force is (the garrote of Breiman 1995, "Better subset regression using the nonnegative
//! garrote").

use glam::Vec2;

/// Time constant in seconds of the mean: vibration of 386 Hz loses 99 %, a touch comes 40 ms late.
const MEAN_S: f32 = 0.04;

/// Density of the noise of an outer acceleration as a share of it, in 1/√Hz: gusts change before the
/// mean follows.
const NOISE_SHARE: f32 = 0.25;

/// Time in seconds for which the part of an outer acceleration that does not count is taken to last. A
/// constant acceleration for that time has the effect of noise with the density of its square times it.
const LASTING_S: f32 = 1.0;

/// The acceleration by an outer force.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct OuterForce {
    mean_m_s2: Vec2,
    /// Square of the part of the mean that counts, in (m/s²)².
    excess: f32,
}

impl OuterForce {
    /// Takes the specific force that drag does not explain, in m/s², of the next `seconds`. Returns
    /// the part that counts, 0 below `least_m_s2`.
    pub fn update(&mut self, unexplained_m_s2: Vec2, least_m_s2: f32, seconds: f32) -> Vec2 {
        self.mean_m_s2 += (unexplained_m_s2 - self.mean_m_s2) * (seconds / (MEAN_S + seconds));
        let square = self.mean_m_s2.length_squared();
        let least = least_m_s2 * least_m_s2;
        self.excess = (square - least).max(0.0);
        if square > least { self.mean_m_s2 * (self.excess / square) } else { Vec2::ZERO }
    }

    /// Returns the squared density of the noise that this force adds, in (m/s²)²/Hz.
    ///
    /// The part that does not count adds noise only as far as the rest shows a force: the offset of the
    /// sensor and vibration are none, and noise costs accuracy with late poses.
    pub fn noise(&self) -> f32 {
        let square = self.mean_m_s2.length_squared();
        if self.excess <= 0.0 {
            return 0.0;
        }
        let counted = self.excess / square;
        let uncounted_m2_s4 = square * (1.0 - counted) * (1.0 - counted);
        NOISE_SHARE * NOISE_SHARE * self.excess + LASTING_S * counted * counted * uncounted_m2_s4
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_force_counts_and_an_offset_does_not() {
        let mut outer = OuterForce::default();
        let mut run = |x: f32| (0..400).map(|_| outer.update(Vec2::new(x, 0.0), 0.3, 0.001)).last();
        assert_eq!(run(0.25), Some(Vec2::ZERO));
        // 1 − 0.09 of the force counts, after ten time constants.
        assert!((run(1.0).unwrap().x - 0.91).abs() < 1e-3);
        assert_eq!(run(0.0), Some(Vec2::ZERO));
        let mut unknown = OuterForce::default();
        assert_eq!(unknown.update(Vec2::splat(1e3), f32::INFINITY, 1.0), Vec2::ZERO);
    }
}
