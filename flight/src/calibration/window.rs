//! Mean and variance of the samples of a window.
//!
//! The recursion is that of Welford, "Note on a Method for Calculating Corrected Sums of Squares
//! and Products", Technometrics 4(3), 1962. It keeps its precision when the mean is large compared
//! with the deviation, and a constant input gives a variance of exactly 0.

use glam::Vec3;

use crate::ImuSample;

/// Running statistics of the samples since the start of a window.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct RestWindow {
    samples: u16,
    gyro: Moments,
    accel: Moments,
}

/// Mean and sum of squared deviations by component.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Moments {
    mean: Vec3,
    squared_deviations: Vec3,
}

impl Moments {
    /// Adds a value, with `weight` = 1 / (number of values including this one).
    fn push(&mut self, value: Vec3, weight: f32) {
        let deviation = value - self.mean;
        self.mean += deviation * weight;
        self.squared_deviations += deviation * (value - self.mean);
    }

    /// Returns true if any component never changed.
    fn is_stuck(&self) -> bool {
        self.squared_deviations.cmpeq(Vec3::ZERO).any()
    }
}

impl RestWindow {
    pub(super) fn push(&mut self, sample: &ImuSample) {
        self.samples = self.samples.saturating_add(1);
        let weight = 1.0 / f32::from(self.samples);
        self.gyro.push(sample.gyro_rad_s, weight);
        self.accel.push(sample.accel_m_s2, weight);
    }

    pub(super) fn samples(&self) -> u16 {
        self.samples
    }

    pub(super) fn gyro_mean_rad_s(&self) -> Vec3 {
        self.gyro.mean
    }

    pub(super) fn accel_mean_m_s2(&self) -> Vec3 {
        self.accel.mean
    }

    /// Returns the unbiased variance, or 0 with fewer than two samples.
    pub(super) fn gyro_variance_rad2_s2(&self) -> Vec3 {
        self.gyro.squared_deviations / self.degrees_of_freedom()
    }

    /// Returns the unbiased variance, or 0 with fewer than two samples.
    pub(super) fn accel_variance_m2_s4(&self) -> Vec3 {
        self.accel.squared_deviations / self.degrees_of_freedom()
    }

    pub(super) fn is_gyro_stuck(&self) -> bool {
        self.gyro.is_stuck()
    }

    pub(super) fn is_accel_stuck(&self) -> bool {
        self.accel.is_stuck()
    }

    fn degrees_of_freedom(&self) -> f32 {
        f32::from(self.samples.saturating_sub(1).max(1))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn moments_agree_with_two_passes_in_f64(
            values in prop::collection::vec(prop::array::uniform3(9.7_f32..9.9), 2..600),
        ) {
            let mut window = RestWindow::default();
            for value in &values {
                let accel_m_s2 = Vec3::from_array(*value);
                window.push(&ImuSample { accel_m_s2, gyro_rad_s: -accel_m_s2 });
            }
            let n = values.len() as f64;
            for axis in 0..3 {
                let column = values.iter().map(|value| f64::from(value[axis]));
                let mean = column.clone().sum::<f64>() / n;
                let variance = column.map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
                prop_assert!((f64::from(window.accel_mean_m_s2()[axis]) - mean).abs() < 2e-5);
                prop_assert!((f64::from(window.gyro_mean_rad_s()[axis]) + mean).abs() < 2e-5);
                let measured = f64::from(window.accel_variance_m2_s4()[axis]);
                prop_assert!((measured - variance).abs() < 0.001 * variance + 1e-9);
                prop_assert_eq!(window.gyro_variance_rad2_s2()[axis] as f64, measured);
            }
        }

        #[test]
        fn constant_axis_is_stuck(value in -100.0_f32..100.0, n in 1_u16..1000) {
            let mut window = RestWindow::default();
            for i in 0..n {
                let changing = f32::from(i % 7);
                window.push(&ImuSample {
                    gyro_rad_s: Vec3::new(changing, value, changing),
                    accel_m_s2: Vec3::new(changing, changing, 9.8 + 0.007 * changing),
                });
            }
            prop_assert!(window.is_gyro_stuck());
            prop_assert!(window.is_accel_stuck() == (n == 1));
        }
    }
}
