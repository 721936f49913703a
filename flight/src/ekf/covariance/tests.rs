//! Tests of the covariance against dense computations in f64.

#![allow(clippy::needless_range_loop)] // Indices read as the formulas do.

use super::super::states::POSITION;
use super::*;
use crate::ekf::EkfRefusal;
use crate::ekf::config::{EkfConfig, Linearization};
use crate::ekf::transition::Motion;
use bittybuzz_random::Random;
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

/// A covariance L·Lᵀ with random entries of L, scaled by state.
fn sample(seed: u32, scale: &[f32; STATES]) -> StateCovariance {
    let mut random = Random::new(seed.into());
    let mut factor = [[0.0; STATES]; STATES];
    for i in 0..STATES {
        for j in 0..=i {
            factor[i][j] = if i == j { 1.0 } else { 0.3 * random.uniform(1.0) as f32 };
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
fn entries_below_the_diagonal_are_ignored_and_invalid_ones_refused() {
    let mut entries = sample(3, &SCALE).full();
    let expected = entries;
    entries[5][2] = f32::NAN;
    assert_eq!(StateCovariance::from_upper(&entries).unwrap().full(), expected);
    entries[4][4] = -1.0;
    assert_eq!(StateCovariance::from_upper(&entries), Err(EkfRefusal::OutOfRange));
    entries[2][5] = f32::INFINITY;
    assert_eq!(StateCovariance::from_upper(&entries), Err(EkfRefusal::NotFinite));
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
