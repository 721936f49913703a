//! The covariance of the error, with the operations of a Kalman filter on it.

#![allow(clippy::needless_range_loop)] // Indices read as the formulas do.

use glam::{Mat3, Vec3};

use super::config::{EkfNoise, EkfSigma};
use super::measurement::EkfRefusal;
use super::states::{ATTITUDE, GYRO_BIAS, STATES, VELOCITY};
use super::transition::{Transition, frame_turn};

/// Largest variance of any state, in the square of its unit.
const VARIANCE_CAP: f32 = 100.0;

/// Ratio of the predicted variance to that of the measurement at which an update makes a second
/// pass: beyond it the subtraction loses more than 10 of the 24 bits of f32.
const SECOND_PASS_RATIO: f32 = 1000.0;

/// A row of a measurement matrix: index and value of each entry that is not zero.
pub(super) type SparseRow<const N: usize> = [(usize, f32); N];

/// Returns one entry, or 0 beyond the end.
#[inline]
pub(super) fn entry(values: &[f32; STATES], index: usize) -> f32 {
    values.get(index).copied().unwrap_or(0.0)
}

/// Returns the product of a sparse row and a column.
#[inline]
pub(super) fn dot<const N: usize>(row: &SparseRow<N>, column: &[f32; STATES]) -> f32 {
    row.iter().map(|&(index, weight)| weight * entry(column, index)).sum()
}

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

    /// Creates the covariance with the given entries on and above the diagonal.
    ///
    /// # Errors
    /// A number that is not finite, or a variance below 0.
    pub fn from_upper(entries: &[[f32; STATES]; STATES]) -> Result<Self, EkfRefusal> {
        for (i, row) in entries.iter().enumerate() {
            for (j, entry) in row.iter().enumerate().skip(i) {
                if !entry.is_finite() {
                    return Err(EkfRefusal::NotFinite);
                }
                if i == j && *entry < 0.0 {
                    return Err(EkfRefusal::OutOfRange);
                }
            }
        }
        Ok(StateCovariance { entries: *entries })
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
        self.entries.get(index).map_or(0.0, |row| entry(row, index))
    }

    /// Returns the three variances from state `first` on.
    pub fn variances(&self, first: usize) -> Vec3 {
        Vec3::new(self.variance(first), self.variance(first + 1), self.variance(first + 2))
    }

    /// Returns true when no variance is infinite or not a number. Such a number elsewhere reaches a
    /// variance with the next prediction.
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
        let EkfNoise { accel_xy, accel_z, position, attitude, gyro_bias, accel_bias, .. } = *noise;
        let densities = [
            position, position, position, accel_xy, accel_xy, accel_z, attitude, attitude,
            attitude, gyro_bias, gyro_bias, gyro_bias, accel_bias,
        ];
        for i in 0..STATES {
            self.entries[i][i] += densities[i] * densities[i] * seconds;
        }
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
                for j in 0..i {
                    self.entries[j][i] *= factor;
                }
                for j in i..STATES {
                    self.entries[i][j] *= factor;
                }
                self.entries[i][i] = VARIANCE_CAP;
            }
        }
    }

    /// Returns the covariance of x and y in the world: the variance of x, the covariance, and the
    /// variance of y.
    pub fn horizontal(&self) -> [f32; 3] {
        [self.entries[0][0], self.entries[0][1], self.entries[1][1]]
    }

    /// Sets the covariance of x and y in the world to that before a measurement whose gain for x
    /// and y was replaced by 0.
    ///
    /// P after a gain K is (I − K·h)·P·(I − K·h)ᵀ + variance·K·Kᵀ. If the rows of x and y of K are
    /// 0 and the others optimal, this differs from the optimal P in these entries only.
    pub fn restore_horizontal(&mut self, [xx, xy, yy]: [f32; 3]) {
        self.entries[0][0] = xx;
        self.entries[0][1] = xy;
        self.entries[1][1] = yy;
    }

    /// Returns P·hᵀ and h·P·hᵀ.
    #[inline]
    pub fn project<const N: usize>(&self, row: &SparseRow<N>) -> ([f32; STATES], f32) {
        let mut product = [0.0; STATES];
        for &(index, weight) in row {
            let Some(own) = self.entries.get(index) else { continue };
            for (i, value) in product.iter_mut().enumerate() {
                // Only the entries on and right of the diagonal hold.
                *value += weight * if i < index { entry(&self.entries[i], index) } else { own[i] };
            }
        }
        let variance = dot(row, &product);
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
            let seen = dot(row, &gain);
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
        let [_, _, _, _, _, _, xx, xy, xz, ..] = entries[ATTITUDE];
        let [_, _, _, _, _, _, _, yy, yz, ..] = entries[ATTITUDE + 1];
        let zz = entries[ATTITUDE + 2][ATTITUDE + 2];
        let block = Mat3::from_cols_array(&[xx, xy, xz, xy, yy, yz, xz, yz, zz]);
        let block = turn * block * turn.transpose();
        entries[ATTITUDE][ATTITUDE..GYRO_BIAS].copy_from_slice(&block.x_axis.to_array());
        entries[ATTITUDE + 1][ATTITUDE + 1] = block.y_axis.y;
        entries[ATTITUDE + 1][ATTITUDE + 2] = block.y_axis.z;
        entries[ATTITUDE + 2][ATTITUDE + 2] = block.z_axis.z;
    }

    /// Adds a variance to that of one state.
    pub fn add_variance(&mut self, index: usize, variance: f32) {
        if let Some(entry) = self.entries.get_mut(index).and_then(|row| row.get_mut(index)) {
            *entry += variance;
        }
    }

    /// Forgets all about three states from `first` on: variances become `sigma`², correlations 0.
    pub fn isolate(&mut self, first: usize, sigma: Vec3) {
        let group = first..first + 3;
        for (i, row) in self.entries.iter_mut().enumerate() {
            for (j, value) in row.iter_mut().enumerate() {
                if group.contains(&i) || group.contains(&j) {
                    let sigma =
                        if i == j { sigma.to_array().get(i - first).copied() } else { None };
                    *value = sigma.map_or(0.0, |sigma| (sigma * sigma).min(VARIANCE_CAP));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests;
