//! The covariance of the error, with the operations of a Kalman filter on it.

use glam::{Mat3, Vec3};

use super::config::{EkfNoise, EkfSigma};
use super::transition::{Transition, frame_turn};

/// Number of the error's states.
pub(super) const STATES: usize = 13;
/// Index of the position's first state.
pub(super) const POSITION: usize = 0;
/// Index of the velocity's first state.
pub(super) const VELOCITY: usize = 3;
/// Index of the first state of the attitude error.
pub(super) const ATTITUDE: usize = 6;
/// Index of the first state of the gyroscope's bias.
pub(super) const GYRO_BIAS: usize = 9;
/// Index of the accelerometer's bias.
pub(super) const ACCEL_BIAS: usize = 12;

/// Largest variance of any state, in the square of its unit.
const VARIANCE_CAP: f32 = 100.0;

/// Ratio of the predicted variance to that of the measurement at which an update makes a second
/// pass: beyond it the subtraction loses more than 10 of the 24 bits of f32.
const SECOND_PASS_RATIO: f32 = 1000.0;

/// A row of a measurement matrix: index and value of each entry that is not zero.
pub(super) type SparseRow<const N: usize> = [(usize, f32); N];

/// The covariance of the error.
///
/// Only entries with row ≤ column are valid between calls, so the matrix is symmetric by
/// construction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct StateCovariance {
    entries: [[f32; STATES]; STATES],
}

impl StateCovariance {
    /// Creates the covariance of independent errors.
    pub fn diagonal(sigma: &EkfSigma) -> Self {
        let position_xy = sigma.position_xy_m;
        let values = [
            position_xy,
            position_xy,
            sigma.position_z_m,
            sigma.velocity_m_s,
            sigma.velocity_m_s,
            sigma.velocity_m_s,
            sigma.tilt_rad,
            sigma.tilt_rad,
            sigma.yaw_rad,
            sigma.gyro_bias_rad_s,
            sigma.gyro_bias_rad_s,
            sigma.gyro_bias_rad_s,
            sigma.accel_bias_m_s2,
        ];
        let mut entries = [[0.0; STATES]; STATES];
        for (i, value) in values.iter().enumerate() {
            entries[i][i] = (value * value).min(VARIANCE_CAP);
        }
        StateCovariance { entries }
    }

    /// Returns the whole symmetric matrix.
    pub fn full(&self) -> [[f32; STATES]; STATES] {
        let mut full = self.entries;
        for i in 1..STATES {
            for j in 0..i {
                full[i][j] = self.entries[j][i];
            }
        }
        full
    }

    /// Returns the variance of state `index`, or 0 when there is no such state.
    pub fn variance(&self, index: usize) -> f32 {
        self.entries.get(index).and_then(|row| row.get(index)).copied().unwrap_or(0.0)
    }

    /// Returns the three variances from state `first` on.
    pub fn variances(&self, first: usize) -> Vec3 {
        Vec3::new(self.variance(first), self.variance(first + 1), self.variance(first + 2))
    }

    /// Returns true when no variance is infinite or not a number.
    pub fn is_finite(&self) -> bool {
        let mut sum = 0.0;
        for i in 0..STATES {
            sum += self.entries[i][i];
        }
        sum.is_finite()
    }

    /// Carries the covariance over one prediction: A·P·Aᵀ.
    ///
    /// The map acts on each row and then on each column. Biases stay as they are, so their rows are
    /// final after the first half.
    pub fn propagate(&mut self, transition: &Transition) {
        for i in 1..STATES {
            for j in 0..i {
                self.entries[i][j] = self.entries[j][i];
            }
        }
        for row in &mut self.entries {
            transition.apply(row);
        }
        for j in 0..GYRO_BIAS {
            let mut column = [0.0; STATES];
            for (value, row) in column.iter_mut().zip(&self.entries) {
                *value = row[j];
            }
            transition.apply(&mut column);
            for i in 0..=j {
                self.entries[i][j] = column[i];
            }
        }
        for bias in GYRO_BIAS..STATES {
            for j in 0..GYRO_BIAS {
                self.entries[j][bias] = self.entries[bias][j];
            }
        }
    }

    /// Adds the noise of `seconds` that acts on each state alone.
    pub fn add_noise(&mut self, noise: &EkfNoise, seconds: f32) {
        let mut add = |i: usize, density: f32| self.entries[i][i] += density * density * seconds;
        for axis in 0..3 {
            add(POSITION + axis, noise.position);
            add(ATTITUDE + axis, noise.attitude);
            add(GYRO_BIAS + axis, noise.gyro_bias);
        }
        add(VELOCITY, noise.accel_xy);
        add(VELOCITY + 1, noise.accel_xy);
        add(VELOCITY + 2, noise.accel_z);
        add(ACCEL_BIAS, noise.accel_bias);
    }

    /// Adds the noise of the gyroscope over `seconds` at the given velocity in the body frame.
    ///
    /// A wrong rate n turns the attitude by −n and the velocity by −v×n, so both errors correlate:
    /// variance |v|²·I − v·vᵀ of the velocity, I of the attitude, [v]× between them.
    pub fn add_gyro_noise(&mut self, density: f32, velocity: Vec3, seconds: f32) {
        let q = density * density * seconds;
        let scaled = velocity * q;
        let v = velocity;
        let entries = &mut self.entries;
        for axis in 0..3 {
            entries[ATTITUDE + axis][ATTITUDE + axis] += q;
        }
        entries[VELOCITY][VELOCITY] += v.y * scaled.y + v.z * scaled.z;
        entries[VELOCITY + 1][VELOCITY + 1] += v.x * scaled.x + v.z * scaled.z;
        entries[VELOCITY + 2][VELOCITY + 2] += v.x * scaled.x + v.y * scaled.y;
        entries[VELOCITY][VELOCITY + 1] -= v.x * scaled.y;
        entries[VELOCITY][VELOCITY + 2] -= v.x * scaled.z;
        entries[VELOCITY + 1][VELOCITY + 2] -= v.y * scaled.z;
        entries[VELOCITY][ATTITUDE + 1] -= scaled.z;
        entries[VELOCITY][ATTITUDE + 2] += scaled.y;
        entries[VELOCITY + 1][ATTITUDE] += scaled.z;
        entries[VELOCITY + 1][ATTITUDE + 2] -= scaled.x;
        entries[VELOCITY + 2][ATTITUDE] -= scaled.y;
        entries[VELOCITY + 2][ATTITUDE + 1] += scaled.x;
    }

    /// Limits the variances: those of position, velocity and attitude to at least `floor`, those of
    /// biases to at least 0, all to at most 100.
    ///
    /// A variance above the cap shrinks with its row and column, which keeps all correlations.
    pub fn limit(&mut self, floor: f32) {
        for i in 0..STATES {
            let least = if i < GYRO_BIAS { floor } else { 0.0 };
            let variance = self.entries[i][i];
            if variance < least {
                self.entries[i][i] = least;
            } else if variance > VARIANCE_CAP {
                let factor = libm::sqrtf(VARIANCE_CAP / variance);
                for j in 0..STATES {
                    self.entries[i.min(j)][i.max(j)] *= factor;
                }
                self.entries[i][i] = VARIANCE_CAP;
            }
        }
    }

    /// Returns P·hᵀ and h·P·hᵀ.
    #[inline]
    pub fn project<const N: usize>(&self, row: &SparseRow<N>) -> ([f32; STATES], f32) {
        let mut product = [0.0; STATES];
        for &(index, weight) in row {
            for (j, value) in product.iter_mut().enumerate() {
                *value += weight * self.entries[j.min(index)][j.max(index)];
            }
        }
        let variance = row.iter().map(|&(index, weight)| weight * product[index]).sum();
        (product, variance)
    }

    /// Applies the measurement of one scalar with matrix `row` and `variance`; returns the gain.
    ///
    /// With v = P·hᵀ and s = h·v + variance, the gain is K = v/s and the covariance P₁ = P − K·vᵀ.
    /// When s is much larger than the variance, rounding spoils what the measurement saw. Then a
    /// second pass evaluates P = T·P₁·Tᵀ + variance·(2 − h·K)·K·Kᵀ with T = I − K·h, an identity
    /// that follows from h·P₁ = variance·Kᵀ; T removes the rounding along h, as Joseph's form does.
    /// `product` and `predicted` are the results of [`Self::project`].
    #[inline]
    pub fn reduce<const N: usize>(
        &mut self,
        row: &SparseRow<N>,
        product: &[f32; STATES],
        predicted: f32,
        variance: f32,
    ) -> [f32; STATES] {
        let inverse = 1.0 / (predicted + variance);
        let gain = product.map(|value| value * inverse);
        for i in 0..STATES {
            for j in i..STATES {
                self.entries[i][j] -= gain[i] * product[j];
            }
        }
        if predicted > SECOND_PASS_RATIO * variance {
            let (rest, rest_variance) = self.project(row);
            let seen: f32 = row.iter().map(|&(index, weight)| weight * gain[index]).sum();
            let scale = rest_variance + variance * (2.0 - seen);
            for i in 0..STATES {
                for j in i..STATES {
                    self.entries[i][j] += gain[i] * (scale * gain[j] - rest[j]) - rest[i] * gain[j];
                }
            }
        }
        gain
    }

    /// Returns the squared Mahalanobis distance of the innovation of three states from `first` on,
    /// each measured with `variance`, or `None` when their covariance is not positive.
    pub fn distance_squared(&self, first: usize, variance: f32, innovation: Vec3) -> Option<f32> {
        let [row0, row1, row2] = self.entries.get(first..first + 3)? else { return None };
        let [s00, s01, s02] = *row0.get(first..first + 3)? else { return None };
        let [_, s11, s12] = *row1.get(first..first + 3)? else { return None };
        let [_, _, s22] = *row2.get(first..first + 3)? else { return None };
        // The factorization L·D·Lᵀ.
        let d0 = s00 + variance;
        let l10 = s01 / d0;
        let l20 = s02 / d0;
        let d1 = s11 + variance - l10 * s01;
        let rest = s12 - l10 * s02;
        let l21 = rest / d1;
        let d2 = s22 + variance - l20 * s02 - l21 * rest;
        let y0 = innovation.x;
        let y1 = innovation.y - l10 * y0;
        let y2 = innovation.z - l20 * y0 - l21 * y1;
        let distance = y0 * y0 / d0 + y1 * y1 / d1 + y2 * y2 / d2;
        (d0 > 0.0 && d1 > 0.0 && d2 > 0.0 && distance.is_finite()).then_some(distance)
    }

    /// Moves the reference of the attitude by the estimated error `angle`: T·P·Tᵀ with
    /// T = exp(−[angle/2]×) (Mueller, Hehn and D'Andrea 2017, equation 28).
    pub fn turn_attitude(&mut self, angle: Vec3) {
        let turn = frame_turn(angle * 0.5);
        for row in self.entries.iter_mut().take(ATTITUDE) {
            let moved = turn * Vec3::new(row[ATTITUDE], row[ATTITUDE + 1], row[ATTITUDE + 2]);
            row[ATTITUDE..GYRO_BIAS].copy_from_slice(&moved.to_array());
        }
        let entries = &mut self.entries;
        for j in GYRO_BIAS..STATES {
            let moved = turn
                * Vec3::new(
                    entries[ATTITUDE][j],
                    entries[ATTITUDE + 1][j],
                    entries[ATTITUDE + 2][j],
                );
            entries[ATTITUDE][j] = moved.x;
            entries[ATTITUDE + 1][j] = moved.y;
            entries[ATTITUDE + 2][j] = moved.z;
        }
        let [xx, xy, xz] = [0, 1, 2].map(|axis| entries[ATTITUDE][ATTITUDE + axis]);
        let [yy, yz] = [1, 2].map(|axis| entries[ATTITUDE + 1][ATTITUDE + axis]);
        let zz = entries[ATTITUDE + 2][ATTITUDE + 2];
        let block = Mat3::from_cols_array(&[xx, xy, xz, xy, yy, yz, xz, yz, zz]);
        let block = turn * block * turn.transpose();
        entries[ATTITUDE][ATTITUDE..GYRO_BIAS].copy_from_slice(&block.x_axis.to_array());
        entries[ATTITUDE + 1][ATTITUDE + 1] = block.y_axis.y;
        entries[ATTITUDE + 1][ATTITUDE + 2] = block.y_axis.z;
        entries[ATTITUDE + 2][ATTITUDE + 2] = block.z_axis.z;
    }

    /// Forgets all about three states from `first` on: variances become `sigma`², correlations 0.
    pub fn isolate(&mut self, first: usize, sigma: Vec3) {
        for (axis, sigma) in sigma.to_array().into_iter().enumerate() {
            let i = first + axis;
            for j in 0..STATES {
                self.entries[i.min(j)][i.max(j)] = 0.0;
            }
            self.entries[i][i] = (sigma * sigma).min(VARIANCE_CAP);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::config::{EkfConfig, Linearization};
    use super::super::transition::Motion;
    use super::*;
    use proptest::prelude::*;

    type Dense = [[f64; STATES]; STATES];

    fn dense(from: impl Fn(usize, usize) -> f64) -> Dense {
        core::array::from_fn(|i| core::array::from_fn(|j| from(i, j)))
    }

    fn multiply(a: &Dense, b: &Dense) -> Dense {
        dense(|i, j| (0..STATES).map(|k| a[i][k] * b[k][j]).sum())
    }

    fn transpose(a: &Dense) -> Dense {
        dense(|i, j| a[j][i])
    }

    /// Joseph's form in f64 for one scalar.
    fn joseph(p: &Dense, h: &[f64; STATES], variance: f64) -> Dense {
        let ph: [f64; STATES] = core::array::from_fn(|i| (0..STATES).map(|j| p[i][j] * h[j]).sum());
        let s: f64 = (0..STATES).map(|i| h[i] * ph[i]).sum::<f64>() + variance;
        let t = dense(|i, j| f64::from(i == j) - ph[i] / s * h[j]);
        let first = multiply(&multiply(&t, p), &transpose(&t));
        dense(|i, j| first[i][j] + ph[i] / s * variance * ph[j] / s)
    }

    /// A covariance L·Lᵀ with entries of L from a simple generator, scaled by state.
    fn sample(seed: u32, scale: &[f32; STATES]) -> StateCovariance {
        let mut value = seed.wrapping_mul(2_654_435_761).wrapping_add(1);
        let mut next = move || {
            value = value.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (value >> 8) as f32 / (1 << 23) as f32 - 1.0
        };
        let mut factor = [[0.0; STATES]; STATES];
        for i in 0..STATES {
            for j in 0..=i {
                factor[i][j] = if i == j { 1.0 } else { 0.3 * next() };
            }
        }
        let mut entries = [[0.0; STATES]; STATES];
        for i in 0..STATES {
            for j in i..STATES {
                let sum: f32 = (0..STATES).map(|k| factor[i][k] * factor[j][k]).sum();
                entries[i][j] = sum * scale[i] * scale[j];
            }
        }
        StateCovariance { entries }
    }

    const SCALE: [f32; STATES] =
        [0.1, 0.1, 0.1, 0.2, 0.2, 0.2, 0.02, 0.02, 0.05, 0.005, 0.005, 0.005, 0.1];

    fn to_dense(p: &StateCovariance) -> Dense {
        let full = p.full();
        dense(|i, j| f64::from(full[i][j]))
    }

    /// Asserts that each entry agrees relative to the standard deviations of its row and column.
    fn assert_close(p: &StateCovariance, expected: &Dense, tolerance: f64) {
        let full = p.full();
        for i in 0..STATES {
            for j in 0..STATES {
                let scale = (expected[i][i] * expected[j][j]).sqrt();
                let difference = (f64::from(full[i][j]) - expected[i][j]).abs();
                assert!(
                    difference <= tolerance * scale,
                    "entry {i},{j}: {} instead of {}",
                    full[i][j],
                    expected[i][j]
                );
            }
        }
    }

    /// Asserts the variance of what a measurement saw, which shrinks most: to 1 % beyond the rounding
    /// of the entries themselves.
    fn assert_seen(p: &StateCovariance, expected: &Dense, h: &[f64; STATES]) {
        let seen = |p: &Dense| -> f64 {
            (0..STATES).map(|i| (0..STATES).map(|j| h[i] * p[i][j] * h[j]).sum::<f64>()).sum()
        };
        let size: f64 = (0..STATES).map(|i| h[i] * h[i] * expected[i][i]).sum();
        let (actual, expected) = (seen(&to_dense(p)), seen(expected));
        let rounding = f64::from(f32::EPSILON) * size;
        assert!(
            (actual - expected).abs() <= 0.01 * expected + 2.0 * rounding,
            "{actual} instead of {expected}, rounding {rounding}"
        );
    }

    fn vector(range: f32) -> impl Strategy<Value = Vec3> {
        prop::array::uniform3(-range..range).prop_map(Vec3::from)
    }

    proptest! {
        #[test]
        fn prediction_equals_the_dense_product(
            seed: u32, turn in vector(0.3), velocity in vector(5.0), impulse in vector(0.2),
            axis in vector(3.0), whole: bool,
        ) {
            let form = if whole { Linearization::WholeAngle } else { Linearization::HalfAngle };
            let motion = Motion {
                rotation: Mat3::from_quat(glam::Quat::from_scaled_axis(axis)),
                velocity_m_s: velocity,
                turn_rad: turn,
                impulse_m_s: impulse,
                drag_per_s: Vec3::new(0.4, 0.3, 0.2),
                seconds: 0.01,
            };
            let transition = Transition::new(&motion, form);
            let columns: [[f32; STATES]; STATES] = core::array::from_fn(|j| {
                let mut unit = [0.0; STATES];
                unit[j] = 1.0;
                transition.apply(&mut unit);
                unit
            });
            let a = dense(|i, j| f64::from(columns[j][i]));
            let mut p = sample(seed, &SCALE);
            let expected = multiply(&multiply(&a, &to_dense(&p)), &transpose(&a));
            p.propagate(&transition);
            assert_close(&p, &expected, 3e-6);
        }

        #[test]
        fn scalar_update_equals_joseph_in_f64(
            seed: u32, weights in prop::array::uniform3(-30.0f32..30.0), first in 0usize..6,
            log_variance in -6.0f32..2.0,
        ) {
            let variance = libm::powf(10.0, log_variance);
            let row = [(first, weights[0]), (first + 3, weights[1]), (first + 7, weights[2])];
            let mut h = [0.0; STATES];
            for (index, weight) in row {
                h[index] = f64::from(weight);
            }
            let mut p = sample(seed, &SCALE);
            let expected = joseph(&to_dense(&p), &h, f64::from(variance));
            let (product, predicted) = p.project(&row);
            p.reduce(&row, &product, predicted, variance);
            assert_close(&p, &expected, 1e-3);
            assert_seen(&p, &expected, &h);
        }

        #[test]
        fn turn_of_attitude_equals_the_dense_product(seed: u32, angle in vector(0.5)) {
            let half = angle.as_dvec3() * 0.5;
            let skew = |v: glam::DVec3| [[0.0, -v.z, v.y], [v.z, 0.0, -v.x], [-v.y, v.x, 0.0]];
            let k = skew(half);
            let t = dense(|i, j| {
                if !(6..9).contains(&i) || !(6..9).contains(&j) {
                    return f64::from(i == j);
                }
                let (i, j) = (i - 6, j - 6);
                let square: f64 = (0..3).map(|n| k[i][n] * k[n][j]).sum();
                f64::from(i == j) - k[i][j] + 0.5 * square
            });
            let mut p = sample(seed, &SCALE);
            let expected = multiply(&multiply(&t, &to_dense(&p)), &transpose(&t));
            p.turn_attitude(angle);
            assert_close(&p, &expected, 3e-6);
        }

        #[test]
        fn distance_equals_that_of_the_inverse(
            seed: u32, innovation in vector(1.0), sigma in 0.01f32..1.0,
        ) {
            let p = sample(seed, &SCALE);
            let full = p.full();
            let block = glam::DMat3::from_cols_array_2d(&core::array::from_fn(|i| {
                core::array::from_fn(|j| {
                    f64::from(full[i][j]) + if i == j { f64::from(sigma).powi(2) } else { 0.0 }
                })
            }));
            let n = innovation.as_dvec3();
            let expected = n.dot(block.inverse() * n);
            let distance = p.distance_squared(POSITION, sigma * sigma, innovation).unwrap();
            prop_assert!((f64::from(distance) - expected).abs() <= 1e-4 * expected + 1e-9);
        }
    }

    /// 100 m² against 1e-6 m² lies beyond the digits of f32: 100 − 100·100/(100 + 1e-6) rounds to
    /// 0 or 8e-6 instead of 1e-6.
    #[test]
    fn precise_measurement_of_an_unknown_position_keeps_its_digits() {
        let mut scale = SCALE;
        scale[..3].fill(10.0);
        for seed in 0..200 {
            let mut p = sample(seed, &scale);
            let mut expected = to_dense(&p);
            for axis in 0..3 {
                let row = [(POSITION + axis, 1.0)];
                let (product, predicted) = p.project(&row);
                p.reduce(&row, &product, predicted, 1e-6);
                let mut h = [0.0; STATES];
                h[POSITION + axis] = 1.0;
                expected = joseph(&expected, &h, f64::from(1e-6f32));
            }
            for axis in 0..3 {
                let ratio = f64::from(p.variance(axis)) / expected[axis][axis];
                assert!((ratio - 1.0).abs() < 1e-3, "seed {seed}, axis {axis}: ratio {ratio}");
            }
            assert_close(&p, &expected, 2e-3);
        }
    }

    #[test]
    fn flow_of_a_fast_unknown_velocity_keeps_its_digits() {
        let row = [(POSITION + 2, -20.0), (VELOCITY, 488.0), (GYRO_BIAS + 1, 4.88)];
        let mut h = [0.0; STATES];
        for (index, weight) in row {
            h[index] = f64::from(weight);
        }
        let mut scale = SCALE;
        scale[..6].fill(10.0);
        for seed in 0..200 {
            let mut p = sample(seed, &scale);
            let expected = joseph(&to_dense(&p), &h, 1.0);
            let (product, predicted) = p.project(&row);
            p.reduce(&row, &product, predicted, 1.0);
            assert_close(&p, &expected, 1e-3);
            assert_seen(&p, &expected, &h);
            for i in 0..STATES {
                assert!(p.variance(i) > 0.0, "seed {seed}, state {i}");
            }
        }
    }

    #[test]
    fn limits_keep_correlations_and_floors() {
        let mut scale = SCALE;
        scale[1] = 50.0;
        let mut p = sample(7, &scale);
        let before = p.full();
        p.limit(1e-8);
        let after = p.full();
        assert_eq!(after[1][1], 100.0);
        let correlation = |p: &[[f32; STATES]; STATES]| p[1][4] / (p[1][1] * p[4][4]).sqrt();
        assert!((correlation(&before) - correlation(&after)).abs() < 1e-6);
        let mut none = StateCovariance { entries: [[0.0; STATES]; STATES] };
        none.limit(1e-6);
        assert_eq!(none.variance(0), 1e-6);
        assert_eq!(none.variance(GYRO_BIAS), 0.0);
    }

    #[test]
    fn noise_grows_with_time() {
        let noise = EkfNoise { gyro: 0.01, ..EkfNoise::NINE_STATES };
        let mut p = StateCovariance { entries: [[0.0; STATES]; STATES] };
        for _ in 0..1000 {
            p.add_noise(&noise, 0.001);
        }
        // 0.5 m/s² · 1 ms in each of 1000 steps is 0.5e-3·√1000 m/s.
        assert!((p.variance(VELOCITY) - 0.25e-3).abs() < 1e-7);
        assert!((p.variance(ATTITUDE) - 1e-5).abs() < 1e-9);
        let velocity = Vec3::new(1.0, -2.0, 0.5);
        let mut p = StateCovariance { entries: [[0.0; STATES]; STATES] };
        p.add_gyro_noise(noise.gyro, velocity, 2.0);
        let full = p.full();
        for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
            // A wrong rate along one axis moves attitude by −n and velocity by −v×n.
            let moved = -velocity.cross(axis);
            for i in 0..3 {
                let n: usize = axis.to_array().iter().position(|x| *x == 1.0).unwrap();
                let expected = -moved[i] * 2e-4;
                assert!((full[VELOCITY + i][ATTITUDE + n] - expected).abs() < 1e-9);
            }
        }
        let expected = (velocity.length_squared() - 1.0) * 2e-4;
        assert!((full[VELOCITY][VELOCITY] - expected).abs() < 1e-9);
        assert_eq!(EkfConfig::default(), EkfConfig::QUADROTOR);
    }
}
