//! Low-pass filters.
//!
//! [`Butterworth`] removes the vibration of the rotors from the inertial sensors. [`FirstOrder`]
//! smooths slow values, such as the voltage of the battery. Both work on a number or on a [`Vec3`].
//!
//! # Derivation
//! The second-order Butterworth low-pass with the angular cutoff frequency 1 is
//! H(s) = 1 / (s² + √2 s + 1). The bilinear transform replaces s by (1 − z⁻¹) / (g (1 + z⁻¹)).
//! With g = tan(π · cutoff / sample rate), the gain at the cutoff stays exactly 1/√2 (Oppenheim and
//! Schafer, "Discrete-Time Signal Processing", third edition, section 7.2.2).
//!
//! The code keeps the two integrators of H(s) as its state and integrates each with the trapezoidal
//! rule, which is the same transform (Zavalishin, "The Art of VA Filter Design", 2018, chapter 4).
//! Compared with the coefficients of a difference equation, this form keeps the gain for a constant
//! input at 1 when the cutoff is low, because no coefficient is close to 2 or 1.

use core::ops::{Add, Mul, Sub};

use glam::Vec3;

/// A value that a filter can process: [`f32`] or [`Vec3`].
pub trait FilterValue:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<f32, Output = Self>
{
    /// Zero.
    const ZERO: Self;

    /// Returns true if every component is finite.
    fn is_finite(self) -> bool;
}

impl FilterValue for f32 {
    const ZERO: Self = 0.0;

    fn is_finite(self) -> bool {
        f32::is_finite(self)
    }
}

impl FilterValue for Vec3 {
    const ZERO: Self = Vec3::ZERO;

    fn is_finite(self) -> bool {
        Vec3::is_finite(self)
    }
}

/// A second-order Butterworth low-pass filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Butterworth<T> {
    /// Gain of each integrator: g.
    integrator_gain: f32,
    /// Share of the first integrator's input that remains after feedback: 1 / (1 + √2 g + g²).
    feedback: f32,
    /// State of the first integrator: the slope of the output.
    slope: T,
    /// State of the second integrator.
    level: T,
    output: T,
}

impl<T: FilterValue> Butterworth<T> {
    /// Returns a filter whose output is `initial`.
    ///
    /// Returns `None` unless 0 < `cutoff_hz` < `sample_rate_hz` / 2.
    pub fn new(cutoff_hz: f32, sample_rate_hz: f32, initial: T) -> Option<Self> {
        let is_below_half_rate = cutoff_hz < 0.5 * sample_rate_hz && sample_rate_hz.is_finite();
        if !(cutoff_hz > 0.0 && is_below_half_rate) {
            return None;
        }
        let g = libm::tanf(core::f32::consts::PI * (cutoff_hz / sample_rate_hz));
        if !(g > 0.0 && g.is_finite()) {
            return None;
        }
        let feedback = 1.0 / (1.0 + g * (g + core::f32::consts::SQRT_2));
        let (slope, level, output) = (T::ZERO, initial, initial);
        Some(Butterworth { integrator_gain: g, feedback, slope, level, output })
    }

    /// Processes one sample and returns the new output.
    ///
    /// A sample that is not finite, or so large that the state would overflow, changes nothing.
    pub fn update(&mut self, input: T) -> T {
        let g = self.integrator_gain;
        let slope = (self.slope + (input - self.level) * g) * self.feedback;
        let output = self.level + slope * g;
        let next_slope = slope * 2.0 - self.slope;
        let next_level = output * 2.0 - self.level;
        if next_slope.is_finite() && next_level.is_finite() && output.is_finite() {
            (self.slope, self.level, self.output) = (next_slope, next_level, output);
        }
        self.output
    }

    /// Returns the output after the last sample.
    pub fn output(&self) -> T {
        self.output
    }

    /// Sets the state as if the input had always been `value`.
    ///
    /// A value that is not finite changes nothing.
    pub fn reset(&mut self, value: T) {
        if value.is_finite() {
            (self.slope, self.level, self.output) = (T::ZERO, value, value);
        }
    }
}

/// A first-order low-pass filter.
///
/// The output follows a step exactly as 1 − exp(−t / time constant) at the moments of the samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FirstOrder<T> {
    /// Share of the distance to the input that the output covers with each sample.
    gain: f32,
    output: T,
}

impl<T: FilterValue> FirstOrder<T> {
    /// Returns a filter whose output is `initial`.
    ///
    /// Returns `None` unless the time constant and the sample rate are finite and greater than 0.
    pub fn new(time_constant_s: f32, sample_rate_hz: f32, initial: T) -> Option<Self> {
        let is_positive = time_constant_s > 0.0 && sample_rate_hz > 0.0;
        if !(is_positive && time_constant_s.is_finite() && sample_rate_hz.is_finite()) {
            return None;
        }
        let gain = -libm::expm1f(-1.0 / (time_constant_s * sample_rate_hz));
        (gain > 0.0).then_some(FirstOrder { gain, output: initial })
    }

    /// Processes one sample and returns the new output.
    ///
    /// A sample that is not finite changes nothing.
    pub fn update(&mut self, input: T) -> T {
        let output = self.output + (input - self.output) * self.gain;
        if output.is_finite() {
            self.output = output;
        }
        self.output
    }

    /// Returns the output after the last sample.
    pub fn output(&self) -> T {
        self.output
    }

    /// Sets the output to `value`; a value that is not finite changes nothing.
    pub fn reset(&mut self, value: T) {
        if value.is_finite() {
            self.output = value;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;
    use std::vec::Vec;

    use proptest::prelude::*;

    use super::*;

    /// Coefficients b0, a1 and a2 of H(z) = b0 (1 + z⁻¹)² / (1 + a1 z⁻¹ + a2 z⁻²).
    fn difference_equation(cutoff_hz: f64, rate_hz: f64) -> (f64, f64, f64) {
        let o = (PI * cutoff_hz / rate_hz).tan();
        let c = 1.0 + 2.0 * (PI / 4.0).cos() * o + o * o;
        let a2 = (1.0 - 2.0 * (PI / 4.0).cos() * o + o * o) / c;
        (o * o / c, 2.0 * (o * o - 1.0) / c, a2)
    }

    /// Gain |H(exp(jω))| of the difference equation.
    fn closed_form_gain(cutoff_hz: f64, rate_hz: f64, frequency_hz: f64) -> f64 {
        let (b0, a1, a2) = difference_equation(cutoff_hz, rate_hz);
        let w = 2.0 * PI * frequency_hz / rate_hz;
        let re = 1.0 + a1 * w.cos() + a2 * (2.0 * w).cos();
        let im = -a1 * w.sin() - a2 * (2.0 * w).sin();
        b0 * (2.0 + 2.0 * w.cos()) / re.hypot(im)
    }

    /// Gain that the filter applies to a sine, by correlation over whole periods (one second).
    fn measured_gain(cutoff_hz: f32, rate_hz: usize, frequency_hz: usize) -> f64 {
        let mut filter = Butterworth::new(cutoff_hz, rate_hz as f32, 0.0_f32).unwrap();
        let phase = |n: usize| 2.0 * PI * (frequency_hz * n % rate_hz) as f64 / rate_hz as f64;
        for n in 0..2 * rate_hz {
            filter.update(phase(n).sin() as f32);
        }
        let (mut sine, mut cosine) = (0.0, 0.0);
        for n in 0..rate_hz {
            let y = f64::from(filter.update(phase(n).sin() as f32));
            sine += y * phase(n).sin();
            cosine += y * phase(n).cos();
        }
        2.0 * sine.hypot(cosine) / rate_hz as f64
    }

    #[test]
    fn gain_at_the_cutoff_is_minus_3_db() {
        for (cutoff, rate) in [(80, 1000), (30, 1000), (20, 100), (8, 500), (1, 1000)] {
            let gain = measured_gain(cutoff as f32, rate, cutoff);
            assert!((gain - 0.5_f64.sqrt()).abs() < 1e-4, "{cutoff} Hz at {rate} Hz: {gain}");
        }
    }

    #[test]
    fn gain_agrees_with_the_transfer_function() {
        for (cutoff, rate) in [(80, 1000), (30, 1000), (20, 100), (240, 500)] {
            for frequency in [1, 5, 10, 40, 47] {
                let gain = measured_gain(cutoff as f32, rate, frequency);
                let expected = closed_form_gain(cutoff as f64, rate as f64, frequency as f64);
                assert!((gain - expected).abs() < 2e-5, "{cutoff}, {frequency}: {gain} {expected}");
            }
        }
        // The 80 Hz filter removes 96 to 99 % of a rotor's vibration.
        for (rotor_hz, most) in [(380, 0.04), (425, 0.02), (470, 0.003)] {
            let gain = measured_gain(80.0, 1000, rotor_hz);
            let expected = closed_form_gain(80.0, 1000.0, rotor_hz as f64);
            assert!((gain - expected).abs() < 2e-5 && gain < most, "{rotor_hz} Hz: {gain}");
        }
    }

    #[test]
    fn impulse_response_agrees_with_the_difference_equation() {
        let (b0, a1, a2) = difference_equation(80.0, 1000.0);
        let mut filter = Butterworth::new(80.0, 1000.0, 0.0_f32).unwrap();
        let mut d = [0.0; 2];
        for n in 0..200 {
            let x = if n == 0 { 1.0 } else { 0.0 };
            let d0 = x - a1 * d[0] - a2 * d[1];
            let expected = b0 * (d0 + 2.0 * d[0] + d[1]);
            d = [d0, d[0]];
            let y = f64::from(filter.update(x as f32));
            assert!((y - expected).abs() < 1e-6, "{n}: {y} {expected}");
        }
    }

    #[test]
    fn constant_input_passes_unchanged_even_with_a_low_cutoff() {
        let mut filter = Butterworth::new(0.05, 1000.0, 0.0_f32).unwrap();
        for _ in 0..60_000 {
            filter.update(3.7);
        }
        assert!((filter.output() - 3.7).abs() < 1e-4, "{}", filter.output());
        filter.reset(-1.5);
        assert_eq!(filter.output(), -1.5);
        assert_eq!(filter.update(-1.5), -1.5);
    }

    #[test]
    fn vector_is_filtered_by_component() {
        let mut filters = [0.0_f32; 3].map(|v| Butterworth::new(30.0, 1000.0, v).unwrap());
        let mut vector = Butterworth::new(30.0, 1000.0, Vec3::ZERO).unwrap();
        for n in 0..100 {
            let input = Vec3::new(n as f32, (n as f32).sin(), -1.0);
            let expected: Vec<f32> =
                filters.iter_mut().zip(input.to_array()).map(|(f, x)| f.update(x)).collect();
            assert_eq!(vector.update(input).to_array().as_slice(), expected.as_slice());
        }
    }

    #[test]
    fn input_that_is_not_finite_changes_nothing() {
        let mut filter = Butterworth::new(80.0, 1000.0, Vec3::ONE).unwrap();
        let mut slow = FirstOrder::new(0.1, 1000.0, 1.0_f32).unwrap();
        let (filter_before, slow_before) = (filter, slow);
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            filter.update(Vec3::new(0.0, bad, 0.0));
            filter.reset(Vec3::splat(bad));
            slow.update(bad);
            slow.reset(bad);
        }
        assert_eq!((filter, slow), (filter_before, slow_before));
    }

    #[test]
    fn invalid_frequencies_are_refused() {
        let infinity = f32::INFINITY;
        for (cutoff, rate) in [
            (0.0, 1000.0),
            (-1.0, 1000.0),
            (500.0, 1000.0),
            (80.0, 0.0),
            (80.0, -1000.0),
            (f32::NAN, 1000.0),
            (80.0, f32::NAN),
            (80.0, infinity),
            (infinity, infinity),
            (1e-38, 3e38),
        ] {
            assert!(Butterworth::new(cutoff, rate, 0.0_f32).is_none(), "{cutoff} {rate}");
        }
        for (time, rate) in [(0.0, 1.0), (1.0, 0.0), (-1.0, 1.0), (f32::NAN, 1.0), (1.0, infinity)]
        {
            assert!(FirstOrder::new(time, rate, 0.0_f32).is_none(), "{time} {rate}");
        }
    }

    #[test]
    fn first_order_filter_follows_the_exponential() {
        let mut filter = FirstOrder::new(0.1, 1000.0, 2.0_f32).unwrap();
        for n in 1..=500 {
            let expected = 3.0 - (-0.01 * f64::from(n)).exp();
            assert!((f64::from(filter.update(3.0)) - expected).abs() < 1e-5);
        }
    }

    proptest! {
        /// The sum of the absolute impulse response bounds the output of a stable filter.
        #[test]
        fn output_is_bounded_and_settles(
            ratio in 0.0005_f32..0.499,
            inputs in prop::collection::vec(-1.0_f32..1.0, 1..400),
        ) {
            let (b0, a1, a2) = difference_equation(f64::from(ratio), 1.0);
            let (mut d1, mut d2, mut bound) = (0.0, 0.0, 0.0);
            for n in 0..20_000 {
                let d0 = f64::from(u8::from(n == 0)) - a1 * d1 - a2 * d2;
                bound += (b0 * (d0 + 2.0 * d1 + d2)).abs();
                (d1, d2) = (d0, d1);
            }
            let mut filter = Butterworth::new(ratio, 1.0, 0.0_f32).unwrap();
            for input in inputs {
                prop_assert!(f64::from(filter.update(input).abs()) < bound + 1e-4);
            }
            // The slowest pole lies near 1 for a low cutoff and near -1 for one near half the rate.
            for _ in 0..(3.0 / ratio + 3.0 / (0.5 - ratio)) as usize {
                filter.update(0.25);
            }
            prop_assert!((filter.output() - 0.25).abs() < 1e-3, "{}", filter.output());
        }

        #[test]
        fn output_stays_finite(
            ratio in 1e-6_f32..0.499_999,
            inputs in prop::collection::vec(any::<f32>(), 1..200),
        ) {
            let mut filter = Butterworth::new(ratio, 1.0, 0.0_f32).unwrap();
            let mut slow = FirstOrder::new(1.0 / ratio, 1.0, 0.0_f32).unwrap();
            for input in inputs {
                prop_assert!(filter.update(input).is_finite());
                prop_assert!(slow.update(input).is_finite());
            }
        }
    }
}
