//! Height and vertical velocity from the vertical acceleration and a measured height.
//!
//! The fast part integrates the acceleration; the slow part follows the measured height. The
//! figures are those of the Crazyflie's firmware (crazyflie-firmware 2a18fc29,
//! `position_estimator_altitude.c`), written as time constants so that the rates may differ.

use crate::GRAVITY_M_S2;

/// Largest vertical acceleration that counts as zero, in m/s² (0.04 g).
///
/// It covers the offset of the accelerometer (20 mg) and the error of the estimated tilt.
const DEAD_ZONE_M_S2: f32 = 0.04 * GRAVITY_M_S2;

/// Time constant with which the integrated velocity decays, in s: a factor of 0.995 at 250 Hz.
const VELOCITY_DECAY_S: f32 = 0.798;

/// Time constant with which the height follows its measurement, in s: a share of 0.1 at 100 Hz.
const HEIGHT_FOLLOW_S: f32 = 0.094_912_2;

/// An estimator of height and vertical velocity.
///
/// Both steps ignore a time that is not finite or not greater than 0.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HeightEstimator {
    /// Velocity from the acceleration alone, which decays to 0.
    integrated_velocity_m_s: f32,
    /// HeightEstimate of the height; `None` before the first measurement.
    estimate: Option<HeightEstimate>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct HeightEstimate {
    height_m: f32,
    velocity_m_s: f32,
}

impl HeightEstimator {
    /// Returns an estimator without a height.
    pub fn new() -> Self {
        HeightEstimator::default()
    }

    /// Integrates the vertical acceleration without gravity, usually at 250 Hz.
    ///
    /// An acceleration that is not finite changes nothing.
    pub fn predict(&mut self, vertical_acceleration_m_s2: f32, dt_s: f32) {
        if !is_valid_time(dt_s) {
            return;
        }
        let acceleration = apply_dead_zone(vertical_acceleration_m_s2);
        let velocity = (self.integrated_velocity_m_s + acceleration * dt_s)
            * libm::expf(-dt_s / VELOCITY_DECAY_S);
        if velocity.is_finite() {
            self.integrated_velocity_m_s = velocity;
        }
    }

    /// Moves the height by the velocity and towards the measured height, usually at 100 Hz.
    ///
    /// The first measurement sets the height. Without a measurement, or with one that is not
    /// finite, the velocity alone moves the height.
    pub fn update(&mut self, measured_height_m: Option<f32>, dt_s: f32) {
        if !is_valid_time(dt_s) {
            return;
        }
        let measured_height_m = measured_height_m.filter(|height| height.is_finite());
        let Some(before) = self.estimate else {
            self.estimate =
                measured_height_m.map(|height_m| HeightEstimate { height_m, velocity_m_s: 0.0 });
            return;
        };
        let share = -libm::expm1f(-dt_s / HEIGHT_FOLLOW_S);
        let correction = measured_height_m.map_or(0.0, |height| (height - before.height_m) * share);
        let change_m = correction + self.integrated_velocity_m_s * dt_s;
        let (height_m, velocity_m_s) = (before.height_m + change_m, change_m / dt_s);
        if height_m.is_finite() && velocity_m_s.is_finite() {
            self.estimate = Some(HeightEstimate { height_m, velocity_m_s });
        }
    }

    /// Returns the height in m, with the zero of the measurement, or `None` before the first one.
    pub fn height_m(&self) -> Option<f32> {
        self.estimate.map(|estimate| estimate.height_m)
    }

    /// Returns the velocity upwards in m/s: the last change of the height by its time.
    ///
    /// The result is `None` before the first measurement.
    pub fn velocity_m_s(&self) -> Option<f32> {
        self.estimate.map(|estimate| estimate.velocity_m_s)
    }
}

fn is_valid_time(dt_s: f32) -> bool {
    dt_s > 0.0 && dt_s.is_finite()
}

/// Returns 0 inside the dead zone and the distance from its edge outside of it.
fn apply_dead_zone(acceleration_m_s2: f32) -> f32 {
    acceleration_m_s2 - acceleration_m_s2.clamp(-DEAD_ZONE_M_S2, DEAD_ZONE_M_S2)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn time_constants_give_the_published_factors() {
        assert!((libm::exp(-0.004 / f64::from(VELOCITY_DECAY_S)) - 0.995).abs() < 1e-6);
        assert!((libm::exp(-0.01 / f64::from(HEIGHT_FOLLOW_S)) - 0.9).abs() < 1e-6);
    }

    #[test]
    fn estimates_agree_with_the_published_recursion() {
        let mut estimator = HeightEstimator::new();
        estimator.update(Some(0.2), 0.01);
        let (mut velocity, mut height) = (0.0_f64, 0.2_f64);
        // 500 Hz: every 2nd step predicts, every 5th updates.
        for n in 0..10_000_u32 {
            let t = f64::from(n) * 0.002;
            if n % 2 == 0 {
                let g = 0.3 * (2.0 * t).sin() + 0.02;
                estimator.predict((g * 9.81) as f32, 0.004);
                let dead = if g > 0.04 {
                    g - 0.04
                } else if g < -0.04 {
                    g + 0.04
                } else {
                    0.0
                };
                velocity = (velocity + dead * 0.004 * 9.81) * 0.995;
            }
            if n % 5 == 0 {
                let measured = 1.0 + 0.5 * t.cos();
                estimator.update(Some(measured as f32), 0.01);
                let next = 0.9 * height + 0.1 * measured + velocity * 0.01;
                let expected_velocity = (next - height) / 0.01;
                height = next;
                let error = f64::from(estimator.height_m().unwrap()) - height;
                assert!(error.abs() < 1e-4, "{t} s: {error}");
                let error = f64::from(estimator.velocity_m_s().unwrap()) - expected_velocity;
                assert!(error.abs() < 1e-3, "{t} s: {error}");
            }
        }
    }

    #[test]
    fn small_offset_of_the_accelerometer_does_not_move_the_height() {
        let mut estimator = HeightEstimator::new();
        estimator.update(Some(1.0), 0.01);
        for _ in 0..10_000 {
            estimator.predict(0.03 * GRAVITY_M_S2, 0.004);
            estimator.update(None, 0.01);
        }
        assert_eq!(estimator.height_m(), Some(1.0));
        assert_eq!(estimator.velocity_m_s(), Some(0.0));
    }

    #[test]
    fn invalid_input_changes_nothing() {
        let mut estimator = HeightEstimator::new();
        estimator.update(Some(f32::NAN), 0.01);
        assert_eq!(estimator.height_m(), None);
        estimator.update(Some(1.0), 0.01);
        let before = estimator;
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            estimator.predict(bad, 0.004);
            estimator.predict(1.0, bad);
            estimator.update(Some(bad), 0.01);
            estimator.update(Some(2.0), bad);
        }
        estimator.update(Some(2.0), 0.0);
        assert_eq!(estimator, before);
    }

    proptest! {
        #[test]
        fn estimates_stay_finite(
            inputs in prop::collection::vec(any::<(f32, Option<f32>, f32)>(), 1..50),
        ) {
            let mut estimator = HeightEstimator::new();
            for (acceleration, measured, dt_s) in inputs {
                estimator.predict(acceleration, dt_s);
                estimator.update(measured, dt_s);
                prop_assert!(estimator.height_m().is_none_or(f32::is_finite));
                prop_assert!(estimator.velocity_m_s().is_none_or(f32::is_finite));
            }
        }
    }
}
