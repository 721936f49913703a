//! An IMU with noise, vibration and quantization, for tests.

use std::f64::consts::{PI, SQRT_2};

use bittybuzz_random::Random;
use glam::Vec3;

use crate::{GRAVITY_M_S2, ImuSample};

/// One step of the converter: 2000 °/s and 24 g by 32768.
const GYRO_STEP_RAD_S: f64 = 2000.0 / 32768.0 * PI / 180.0;
const ACCEL_STEP_M_S2: f64 = 24.0 / 32768.0 * GRAVITY_M_S2 as f64;

/// A sensor that samples at 1 kHz.
///
/// Noise is white noise after a second-order low-pass with the sensor's bandwidth, as a real sensor
/// with an internal filter gives it. That makes repeated values more likely than white noise does.
pub(super) struct SimulatedImu {
    pub(super) random: Random,
    noise: [BandLimitedNoise; 6],
    samples: u32,
    pub(super) gyro_rms_rad_s: f64,
    pub(super) accel_rms_m_s2: f64,
    /// Amplitudes of the vibration of each rotor.
    pub(super) gyro_vibration_rad_s: f64,
    pub(super) accel_vibration_m_s2: f64,
    pub(super) rotor_hz: [f64; 4],
}

/// A second-order low-pass of white noise, scaled to unit variance.
#[derive(Clone, Copy, Default)]
struct BandLimitedNoise {
    delayed: [f64; 2],
}

impl BandLimitedNoise {
    /// Low-pass with a bandwidth of 116 Hz; the factor is the measured inverse of its rms.
    fn next(&mut self, white: f64) -> f64 {
        let o = (PI * 0.116).tan();
        let c = 1.0 + SQRT_2 * o + o * o;
        let (a1, a2) = (2.0 * (o * o - 1.0) / c, (1.0 - SQRT_2 * o + o * o) / c);
        let [d1, d2] = self.delayed;
        let d0 = white - a1 * d1 - a2 * d2;
        self.delayed = [d0, d1];
        // Variance of the output for white noise: the integral of |H|², close to 2.22 · 0.116.
        o * o / c * (d0 + 2.0 * d1 + d2) / (2.0 * 0.116 * PI / (2.0 * SQRT_2)).sqrt()
    }
}

impl SimulatedImu {
    /// Noise of the BMI088's data sheet, without vibration.
    pub(super) fn at_rest(seed: u64) -> Self {
        SimulatedImu {
            random: Random::new(seed),
            noise: [BandLimitedNoise::default(); 6],
            samples: 0,
            gyro_rms_rad_s: 0.16 * PI / 180.0,
            accel_rms_m_s2: 0.0022 * f64::from(GRAVITY_M_S2),
            gyro_vibration_rad_s: 0.0,
            accel_vibration_m_s2: 0.0,
            rotor_hz: [380.0, 411.0, 437.0, 470.0],
        }
    }

    /// Vibration of four rotors with up to 2 g and 40 °/s together.
    pub(super) fn in_flight(seed: u64) -> Self {
        SimulatedImu {
            gyro_vibration_rad_s: 10.0 * PI / 180.0,
            accel_vibration_m_s2: 0.5 * f64::from(GRAVITY_M_S2),
            ..SimulatedImu::at_rest(seed)
        }
    }

    /// The next sample while the true values are as given.
    pub(super) fn sample(&mut self, gyro_rad_s: Vec3, accel_m_s2: Vec3) -> ImuSample {
        let sample = ImuSample {
            gyro_rad_s: Vec3::from_array([0, 1, 2].map(|i| self.measure(i, gyro_rad_s[i]))),
            accel_m_s2: Vec3::from_array([0, 1, 2].map(|i| self.measure(3 + i, accel_m_s2[i]))),
        };
        self.samples += 1;
        sample
    }

    /// The value of a channel: 0 to 2 are the gyroscope, 3 to 5 the accelerometer.
    fn measure(&mut self, channel: usize, truth: f32) -> f32 {
        let (rms, vibration, step) = if channel < 3 {
            (self.gyro_rms_rad_s, self.gyro_vibration_rad_s, GYRO_STEP_RAD_S)
        } else {
            (self.accel_rms_m_s2, self.accel_vibration_m_s2, ACCEL_STEP_M_S2)
        };
        let t = f64::from(self.samples) * 0.001;
        let white = self.random.normal();
        let noise = rms * self.noise[channel].next(white);
        let rotors = self.rotor_hz.iter().map(|hz| (2.0 * PI * hz * t + channel as f64).sin());
        let value = f64::from(truth) + noise + vibration * rotors.sum::<f64>();
        ((value / step).round().clamp(-32768.0, 32767.0) * step) as f32
    }
}
