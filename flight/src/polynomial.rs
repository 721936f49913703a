//! Polynomials of degree 7 on an interval of time.
//!
//! Degree 7 is the least that fixes position, velocity, acceleration and jerk at both ends. It also
//! minimizes the integral of the squared snap, to which the torques of a quadrotor are proportional
//! (Mellinger and Kumar 2011).
//!
//! # Precision
//! A power series in seconds loses digits in `f32`: near the end, terms of alternating sign cancel.
//! Coefficients here are powers of z, which grows from -1 to 1 over the interval; for a motion from
//! rest to rest over 1 m the largest coefficient is then 1.1 instead of 84.
//!
//! # Bounds
//! The values of a polynomial lie in the convex hull of its Bernstein coefficients (Farin 2002,
//! chapter 4), so a test of few points proves a limit for the whole interval. The interval is
//! divided into [`HULLS`] parts, as the hull of a part is closer to its values.

use crate::bounds::within;
use core::ops::{Add, Mul, Sub};
use glam::Vec3;

/// Peak speed from rest to rest, as a multiple of distance per duration: 35/16.
pub const PEAK_SPEED: f32 = 2.1875;
/// Peak acceleration from rest to rest, as a multiple of distance per duration²: 84/25·√5.
pub const PEAK_ACCELERATION: f32 = 7.513_188;
/// Peak jerk from rest to rest, as a multiple of distance per duration³: 105/2.
pub const PEAK_JERK: f32 = 52.5;
/// Shortest duration in seconds. Its inverse to the fourth power is far from the largest `f32`.
pub const DURATION_S_MIN: f32 = 1e-3;
/// Longest duration in seconds.
pub const DURATION_S_MAX: f32 = 3600.0;
/// Highest derivative that a polynomial evaluates.
pub const DERIVATIVE_MAX: usize = 4;
/// Parts of the interval for bounds.
pub const HULLS: usize = 8;

/// Coefficients of a polynomial of degree 7.
const TERMS: usize = 8;

/// A quantity that varies over time, such as an angle or a position.
pub trait Coordinate:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<f32, Output = Self>
{
    /// The neutral element of addition.
    const ZERO: Self;
    /// Returns the magnitude.
    fn magnitude(self) -> f32;
}

impl Coordinate for f32 {
    const ZERO: f32 = 0.0;
    fn magnitude(self) -> f32 {
        libm::fabsf(self)
    }
}

impl Coordinate for Vec3 {
    const ZERO: Vec3 = Vec3::ZERO;
    fn magnitude(self) -> f32 {
        self.length()
    }
}

/// The motion at an end of a polynomial, where the jerk is zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Endpoint<V> {
    /// Position, in m or rad.
    pub position: V,
    /// Velocity, per second.
    pub velocity: V,
    /// Acceleration, per second².
    pub acceleration: V,
}

impl<V: Coordinate> Endpoint<V> {
    /// Returns an end at rest.
    pub fn at_rest(position: V) -> Self {
        Endpoint { position, velocity: V::ZERO, acceleration: V::ZERO }
    }
}

/// A polynomial of degree 7 on the interval from 0 to its duration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Polynomial<V> {
    /// Coefficients of the powers of z = 2 t / duration - 1.
    coefficients: [V; TERMS],
    duration_s: f32,
}

impl<V: Coordinate> Polynomial<V> {
    /// Returns the polynomial that leads from `start` to `end`, with zero jerk at both ends.
    ///
    /// Returns `None` if a number is not finite or the duration is not in the range of
    /// [`DURATION_S_MIN`] to [`DURATION_S_MAX`].
    pub fn between(start: Endpoint<V>, end: Endpoint<V>, duration_s: f32) -> Option<Self> {
        // Derivatives by z. The sum of both ends fixes the even powers if a derivative is even,
        // otherwise the difference does; so two systems of 4 equations replace one of 8.
        let half = 0.5 * duration_s;
        let (v0, v1) = (start.velocity * half, end.velocity * half);
        let (a0, a1) = (start.acceleration * (half * half), end.acceleration * (half * half));
        let even_p = (start.position + end.position) * 0.5;
        let even_v = (v1 - v0) * 0.5;
        let even_a = (a0 + a1) * 0.5;
        let odd_p = (end.position - start.position) * 0.5;
        let odd_v = (v0 + v1) * 0.5;
        let odd_a = (a1 - a0) * 0.5;

        let c6 = (even_v - even_a) * (1.0 / 16.0);
        let c4 = c6 * -5.0;
        let c2 = even_a * 0.5 + c6 * 15.0;
        let c0 = even_p - c2 - c4 - c6;
        let c7 = ((odd_v - odd_p) * 5.0 - odd_a * 2.0) * (1.0 / 16.0);
        let c5 = (odd_a + c7 * 168.0) * (-1.0 / 40.0);
        let c3 = (c5 * 10.0 + c7 * 35.0) * -1.0;
        let c1 = odd_p - c3 - c5 - c7;
        Self::checked([c0, c1, c2, c3, c4, c5, c6, c7], duration_s)
    }

    /// Returns the polynomial with these coefficients of the powers of the time in seconds.
    ///
    /// Returns `None` if a number is not finite or the duration is not in the range of
    /// [`DURATION_S_MIN`] to [`DURATION_S_MAX`].
    pub fn from_powers_of_time(powers: [V; TERMS], duration_s: f32) -> Option<Self> {
        // Horner's scheme, where the unknown is t = duration/2 · (1 + z).
        let half = 0.5 * duration_s;
        let mut coefficients = [V::ZERO; TERMS];
        for power in powers.into_iter().rev() {
            let mut lower = V::ZERO;
            for coefficient in &mut coefficients {
                let this = *coefficient;
                *coefficient = (this + lower) * half;
                lower = this;
            }
            coefficients[0] = coefficients[0] + power;
        }
        Self::checked(coefficients, duration_s)
    }

    fn checked(coefficients: [V; TERMS], duration_s: f32) -> Option<Self> {
        let is_finite = coefficients.iter().all(|c| c.magnitude().is_finite());
        let is_valid = is_finite && (DURATION_S_MIN..=DURATION_S_MAX).contains(&duration_s);
        is_valid.then_some(Polynomial { coefficients, duration_s })
    }

    /// Returns the duration in seconds, from [`DURATION_S_MIN`] to [`DURATION_S_MAX`].
    pub fn duration_s(&self) -> f32 {
        self.duration_s
    }

    /// Returns this polynomial moved by `offset`.
    pub fn moved_by(mut self, offset: V) -> Self {
        self.coefficients[0] = self.coefficients[0] + offset;
        self
    }

    /// Returns the value and the first 4 derivatives by time, at a time that is limited to the
    /// interval.
    pub fn at(&self, time_s: f32) -> [V; DERIVATIVE_MAX + 1] {
        let rate = 2.0 / self.duration_s;
        // `max` and `min` also turn a time that is not a number into 0.
        let z = within(time_s, 0.0, self.duration_s) * rate - 1.0;
        // Horner's scheme; each row divides the row above by (x - z) once more, which leaves the
        // derivatives over their factorials.
        let mut rows = [V::ZERO; DERIVATIVE_MAX + 1];
        for coefficient in self.coefficients.into_iter().rev() {
            let mut above = coefficient;
            for row in &mut rows {
                let old = *row;
                *row = old * z + above;
                above = old;
            }
        }
        let mut scale = 1.0;
        for (row, factor) in rows.iter_mut().zip([rate, 2.0 * rate, 3.0 * rate, 4.0 * rate, 0.0]) {
            *row = *row * scale;
            scale *= factor;
        }
        rows
    }

    /// Returns true if `is_inside` holds for every point whose convex hull contains the derivative
    /// of this order (0 to 4) over the whole interval.
    ///
    /// When `is_inside` describes a convex set, the derivative never leaves that set. The answer
    /// can be false although the derivative stays just inside.
    pub fn hull_is_inside(&self, order: usize, mut is_inside: impl FnMut(V) -> bool) -> bool {
        let (mut points, degree) = self.bernstein(order);
        for part in 0..HULLS {
            let share = 1.0 / (HULLS - part) as f32;
            let (first, rest) = split(points, degree, share);
            if !first.iter().take(degree + 1).all(|&point| is_inside(point)) {
                return false;
            }
            points = rest;
        }
        true
    }

    /// Returns an upper bound of the magnitude of the derivative of this order (0 to 4).
    pub fn peak_bound(&self, order: usize) -> f32 {
        let mut most: f32 = 0.0;
        self.hull_is_inside(order, |point| {
            most = most.max(point.magnitude());
            true
        });
        most
    }

    /// Returns the Bernstein coefficients of a derivative, and its degree.
    fn bernstein(&self, order: usize) -> ([V; TERMS], usize) {
        let order = order.min(DERIVATIVE_MAX);
        let degree = TERMS - 1 - order;
        let mut powers = self.coefficients;
        for _ in 0..order {
            for k in 0..TERMS - 1 {
                powers[k] = powers[k + 1] * ((k + 1) as f32 * 2.0 / self.duration_s);
            }
            powers[TERMS - 1] = V::ZERO;
        }
        let mut points = [V::ZERO; TERMS];
        for (point, weights) in points.iter_mut().zip(&BLOSSOMS[order]).take(degree + 1) {
            for (power, weight) in powers.iter().zip(weights).take(degree + 1) {
                *point = *point + *power * *weight;
            }
        }
        (points, degree)
    }
}

/// The share of each power in each Bernstein coefficient of a derivative, by its order. The table
/// saves 22 000 of 80 000 instructions of a plan to land.
static BLOSSOMS: [[[f32; TERMS]; TERMS]; DERIVATIVE_MAX + 1] = {
    let mut orders = [[[0.0; TERMS]; TERMS]; DERIVATIVE_MAX + 1];
    let mut order = 0;
    while order <= DERIVATIVE_MAX {
        orders[order] = blossoms(TERMS - 1 - order);
        order += 1;
    }
    orders
};

/// Returns the share of power k in the Bernstein coefficient i at \[i\]\[k\].
///
/// Coefficient i is the blossom (Farin 2002, section 4.8) of i arguments 1 and the others -1: zᵏ
/// contributes the elementary symmetric polynomial of order k over its number of terms.
const fn blossoms(degree: usize) -> [[f32; TERMS]; TERMS] {
    let mut shares = [[0.0; TERMS]; TERMS];
    let mut i = 0;
    while i <= degree {
        let mut symmetric = [0.0_f32; TERMS];
        symmetric[0] = 1.0;
        let mut argument = 0;
        while argument < degree {
            let z = if argument < i { 1.0 } else { -1.0 };
            let mut k = degree;
            while k > 0 {
                symmetric[k] += z * symmetric[k - 1];
                k -= 1;
            }
            argument += 1;
        }
        let mut terms = 1.0;
        let mut k = 0;
        while k <= degree {
            shares[i][k] = symmetric[k] / terms;
            terms *= (degree - k) as f32 / (k + 1) as f32;
            k += 1;
        }
        i += 1;
    }
    shares
}

/// Splits Bernstein coefficients at a share of the interval (de Casteljau's algorithm).
fn split<V: Coordinate>(
    mut points: [V; TERMS],
    degree: usize,
    share: f32,
) -> ([V; TERMS], [V; TERMS]) {
    let mut first = points;
    for (level, point) in first.iter_mut().enumerate().take(degree + 1) {
        *point = points[0];
        for i in 0..degree.saturating_sub(level).min(TERMS - 1) {
            points[i] = points[i] + (points[i + 1] - points[i]) * share;
        }
    }
    (first, points)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    /// Solves the 8 equations of position, velocity, acceleration and jerk at both ends in `f64` by
    /// elimination, for powers of the time.
    pub(crate) fn solve_with_jerk(start: [f64; 4], end: [f64; 4], t: f64) -> [f64; 8] {
        let mut rows: Vec<[f64; 9]> = Vec::new();
        for (time, values) in [(0.0_f64, start), (t, end)] {
            for (order, value) in values.iter().enumerate() {
                let mut row = [0.0; 9];
                for (power, cell) in row.iter_mut().enumerate().take(8).skip(order) {
                    let factor: usize = (power - order + 1..=power).product();
                    *cell = factor as f64 * time.powi((power - order) as i32);
                }
                row[8] = *value;
                rows.push(row);
            }
        }
        for column in 0..8 {
            let pivot = (column..8)
                .max_by(|&a, &b| rows[a][column].abs().total_cmp(&rows[b][column].abs()))
                .unwrap();
            rows.swap(column, pivot);
            let chosen = rows[column];
            for (_, row) in rows.iter_mut().enumerate().filter(|(row, _)| *row != column) {
                let factor = row[column] / chosen[column];
                for (cell, above) in row.iter_mut().zip(chosen) {
                    *cell -= factor * above;
                }
            }
        }
        core::array::from_fn(|k| rows[k][8] / rows[k][k])
    }

    /// Solves the same equations for zero jerk.
    fn solve([x0, v0, a0]: [f64; 3], [xf, vf, af]: [f64; 3], t: f64) -> [f64; 8] {
        solve_with_jerk([x0, v0, a0, 0.0], [xf, vf, af, 0.0], t)
    }

    /// Evaluates a derivative of a power series in `f64`.
    fn derivative(powers: &[f64; 8], order: usize, t: f64) -> f64 {
        (order..8)
            .map(|k| {
                let factor: usize = (k - order + 1..=k).product();
                factor as f64 * powers[k] * t.powi((k - order) as i32)
            })
            .sum()
    }

    /// The closed form of the coefficients by powers of the time.
    fn closed_form(start: [f64; 3], end: [f64; 3], t: f64) -> [f64; 8] {
        let [x0, v0, a0] = start;
        let [xf, vf, af] = end;
        let d = x0 - xf;
        [
            x0,
            v0,
            a0 / 2.0,
            0.0,
            -5.0 * (14.0 * d + 8.0 * t * v0 + 6.0 * t * vf + 2.0 * t * t * a0 - t * t * af)
                / (2.0 * t.powi(4)),
            (84.0 * d + 45.0 * t * v0 + 39.0 * t * vf + 10.0 * t * t * a0 - 7.0 * t * t * af)
                / t.powi(5),
            -(140.0 * d + 72.0 * t * v0 + 68.0 * t * vf + 15.0 * t * t * a0 - 13.0 * t * t * af)
                / (2.0 * t.powi(6)),
            2.0 * (10.0 * d + 5.0 * t * v0 + 5.0 * t * vf + t * t * a0 - t * t * af) / t.powi(7),
        ]
    }

    fn endpoint(values: [f64; 3]) -> Endpoint<f32> {
        Endpoint {
            position: values[0] as f32,
            velocity: values[1] as f32,
            acceleration: values[2] as f32,
        }
    }

    prop_compose! {
        /// Numbers that `f32` holds exactly, so that a comparison with `f64` is fair.
        fn motion()(p in -5.0_f32..5.0, v in -2.0_f32..2.0, a in -3.0_f32..3.0) -> [f64; 3] {
            [p as f64, v as f64, a as f64]
        }
    }

    proptest! {
        #[test]
        fn closed_form_solves_the_equations_of_both_ends(
            start in motion(), end in motion(), t in 0.3_f64..12.0,
        ) {
            let expected = solve(start, end, t);
            for (k, (a, b)) in closed_form(start, end, t).iter().zip(expected).enumerate() {
                let scale = (t.powi(k as i32)).recip() * 1e3;
                prop_assert!((a - b).abs() < 1e-9 * scale, "c{k}: {a} {b}");
            }
        }

        #[test]
        fn single_precision_keeps_four_digits(
            start in motion(), end in motion(), t in 0.3_f32..10.0, share in 0.0_f32..=1.0,
        ) {
            let expected = solve(start, end, t as f64);
            let curve = Polynomial::between(endpoint(start), endpoint(end), t).unwrap();
            let time = share * t;
            let actual = curve.at(time);
            let tolerance = [1e-4, 1e-4, 3e-4, 3e-3, 3e-2];
            for order in 0..=4 {
                let value = derivative(&expected, order, time as f64);
                // Each derivative by time multiplies the one by z, and its rounding, by 2/T.
                let allowed = tolerance[order] * (2.0 / t as f64).powi(order as i32).max(1.0);
                let error = (actual[order] as f64 - value).abs();
                prop_assert!(error < allowed, "{order}: {error} of {value}");
            }
        }

        #[test]
        fn powers_of_time_give_the_same_curve(
            start in motion(), end in motion(), t in 0.3_f32..4.0, share in 0.0_f32..=1.0,
        ) {
            let powers = solve(start, end, t as f64);
            let curve = Polynomial::from_powers_of_time(powers.map(|c| c as f32), t).unwrap();
            let value = derivative(&powers, 0, (share * t) as f64);
            prop_assert!((curve.at(share * t)[0] as f64 - value).abs() < 1e-3);
        }

        #[test]
        fn bound_is_above_every_sample_and_close(
            start in motion(), end in motion(), t in 0.5_f32..5.0,
        ) {
            let curve = Polynomial::between(endpoint(start), endpoint(end), t).unwrap();
            for order in 0..=4 {
                let bound = curve.peak_bound(order);
                let most = (0..=500)
                    .map(|i| curve.at(t * i as f32 / 500.0)[order].abs())
                    .fold(0.0, f32::max);
                let rounding = 1e-5 * (14.0 / t).powi(order as i32).max(1.0);
                prop_assert!(bound >= most - rounding, "{order}: {bound} < {most}");
                prop_assert!(bound <= 1.1 * most + rounding, "{order}: {bound} >> {most}");
            }
        }
    }

    #[test]
    fn rest_to_rest_has_the_closed_form_and_its_peaks() {
        let (d, t) = (3.0, 2.5);
        let curve =
            Polynomial::between(Endpoint::at_rest(1.0), Endpoint::at_rest(1.0 + d), t).unwrap();
        let mut peaks = [0.0_f32; 4];
        for i in 0..=20_000 {
            let tau = i as f64 / 20_000.0;
            let s =
                35.0 * tau.powi(4) - 84.0 * tau.powi(5) + 70.0 * tau.powi(6) - 20.0 * tau.powi(7);
            let now = curve.at(tau as f32 * t);
            assert!((now[0] as f64 - 1.0 - d as f64 * s).abs() < 2e-6);
            for (peak, value) in peaks.iter_mut().zip(now) {
                *peak = peak.max(value.abs());
            }
        }
        assert!((peaks[1] / (PEAK_SPEED * d / t) - 1.0).abs() < 1e-5);
        assert!((peaks[2] / (PEAK_ACCELERATION * d / (t * t)) - 1.0).abs() < 1e-5);
        assert!((peaks[3] / (PEAK_JERK * d / (t * t * t)) - 1.0).abs() < 1e-4);
        assert!((PEAK_ACCELERATION - 7.51).abs() < 0.005);
        let excess = curve.peak_bound(1) / peaks[1];
        assert!((1.0..1.02).contains(&excess), "{excess}");
    }

    #[test]
    fn vectors_are_three_numbers() {
        let start = Endpoint {
            position: Vec3::new(1.0, -2.0, 0.5),
            velocity: Vec3::new(0.1, 0.4, -0.3),
            acceleration: Vec3::new(-1.0, 0.0, 2.0),
        };
        let end = Endpoint::at_rest(Vec3::new(2.0, 3.0, 1.0));
        let curve = Polynomial::between(start, end, 2.0).unwrap();
        for axis in 0..3 {
            let pick = |e: Endpoint<Vec3>| Endpoint {
                position: e.position[axis],
                velocity: e.velocity[axis],
                acceleration: e.acceleration[axis],
            };
            let single = Polynomial::between(pick(start), pick(end), 2.0).unwrap();
            assert_eq!(single.at(0.7), curve.at(0.7).map(|v| v[axis]));
        }
    }

    #[test]
    fn refuses_numbers_that_are_not_finite() {
        let (rest, end) = (Endpoint::at_rest(0.0), Endpoint::at_rest(1.0));
        for duration in [0.0, -1.0, 1e-4, 4000.0, f32::NAN, f32::INFINITY] {
            assert_eq!(Polynomial::between(rest, end, duration), None);
        }
        assert_eq!(Polynomial::between(rest, Endpoint::at_rest(f32::NAN), 1.0), None);
        assert_eq!(Polynomial::from_powers_of_time([f32::INFINITY; 8], 1.0), None);
        assert_eq!(Polynomial::between(rest, end, 1.0).unwrap().at(f32::NAN)[0], 0.0);
    }
}
