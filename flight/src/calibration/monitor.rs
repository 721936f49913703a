//! Detection of a failure of the inertial sensors in flight.
//!
//! A quadrotor without its gyroscope tumbles within a tenth of a second, so the motors must stop
//! within 50 ms. [`ImuMonitor`] reports each fault below within 40 ms at a sample rate of 1 kHz.
//!
//! # Faults and limits
//! * **Silent**: no sample for more than 5 ms. A driver that frees a stuck bus and reads again
//!   needs less than 1 ms, and in 5 ms the attitude hardly changes.
//! * **Not finite**: a value is infinite or NaN. The sensor measures integers, so the program is at
//!   fault, and one such value would destroy every filter.
//! * **Saturated**: 5 samples in a row beyond 1999 °/s (full scale: 2000 °/s) or 16 g (full scale:
//!   24 g). Fewer samples may be the shock of a landing.
//! * **Stuck**: one axis repeats the same value 35 times. The noise of the sensors (0.16 °/s and
//!   2 mg rms, which is 3 steps of the converter each) changes every axis within a few samples, even
//!   with motors off. Noise half as strong gives a false fault at rest about once a month. A
//!   simulated sensor without noise counts as stuck.
//! * **Noisy**: the running rms of the high-passed signal exceeds 40 °/s or 5 g on one axis.
//!
//! # The high-pass
//! The high-pass is a quarter of the second difference, (x₀ − 2 x₁ + x₂) / 4, with the gain
//! sin²(π f / rate).
//!
//! Maneuvers do not pass: the rotors need tens of milliseconds to change a torque that accelerates
//! by at most 500 rad/s², which gives 0.1 °/s here.
//!
//! Vibration passes and must not be a fault. Expected are 380 to 470 Hz, up to 2 g, and up to
//! 40 °/s: the rate that an imbalance of 2 g on the arm of one motor causes without any filter in
//! the gyroscope. The limits leave room for 50 °/s and 6 g.
//!
//! White noise passes with a gain of √6/4. Noise of 130 °/s or 14 g rms is found within 40 ms in 99
//! of 100 cases, and weaker noise down to 65 °/s or 8 g later.
//!
//! A single wrong sample or a collision gives a large, short output. Its square therefore counts at
//! most as the square of twice the limit, so that the three outputs of one sample are too few.
//!
//! # Not detected
//! A bias that appears in flight looks like motion here. The estimator finds it by comparing with
//! other sensors.

use core::f32::consts::PI;

use glam::Vec3;

use crate::{GRAVITY_M_S2, ImuSample};

/// Longest time without a sample, in seconds: 5 ms, with half a period of tolerance for jitter.
const SILENCE_S_MAX: f32 = 0.005_5;

/// Angular rate from which the gyroscope counts as saturated, in rad/s (1999 °/s).
const SATURATED_GYRO_RAD_S: f32 = 1999.0 * PI / 180.0;

/// Specific force from which the accelerometer counts as saturated, in m/s².
const SATURATED_ACCEL_M_S2: f32 = 16.0 * GRAVITY_M_S2;

/// Number of saturated samples in a row that make a fault.
const SATURATED_SAMPLES: u8 = 5;

/// Number of repetitions of a value that make a fault.
const STUCK_REPETITIONS: u8 = 35;

/// Largest rms of the high-passed angular rate, in rad/s (40 °/s).
const NOISY_GYRO_RAD_S: f32 = 40.0 * PI / 180.0;

/// Largest rms of the high-passed specific force, in m/s².
const NOISY_ACCEL_M_S2: f32 = 5.0 * GRAVITY_M_S2;

/// Share of the newest value in the running mean square: a time constant of 16 samples.
const MEAN_SQUARE_SHARE: f32 = 1.0 / 16.0;

/// A failure of the inertial sensors.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ImuFault {
    /// No sample arrived for more than 5 ms, or the time was invalid.
    Silent,
    /// A value was not finite.
    NotFinite,
    /// The gyroscope is at the end of its range.
    GyroSaturated,
    /// The accelerometer measures more than 16 g.
    AccelSaturated,
    /// An axis of the gyroscope repeats the same value.
    GyroStuck,
    /// An axis of the accelerometer repeats the same value.
    AccelStuck,
    /// The gyroscope is noisier than the vibration of the rotors explains.
    GyroNoisy,
    /// The accelerometer is noisier than the vibration of the rotors explains.
    AccelNoisy,
}

/// A monitor of the inertial sensors.
///
/// A fault lasts only as long as its cause: the caller decides if it stops the motors for good.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ImuMonitor {
    silence_s: f32,
    gyro: SensorHistory,
    accel: SensorHistory,
}

impl ImuMonitor {
    /// Returns a monitor without history.
    pub fn new() -> Self {
        ImuMonitor::default()
    }

    /// Processes a sample as the sensor measured it, before filters and calibration.
    ///
    /// `raw` is `None` if the sensor gave no new sample. `dt_s` is the time since the last call, in
    /// seconds. Call it at least once per millisecond, also without a sample.
    ///
    /// # Errors
    /// Returns the fault that is present after this sample. An invalid sample counts as missing,
    /// and a time that is negative or not finite counts as silence.
    pub fn update(&mut self, raw: Option<&ImuSample>, dt_s: f32) -> Result<(), ImuFault> {
        let is_time_valid = dt_s >= 0.0 && dt_s.is_finite();
        let silence_s = if is_time_valid { self.silence_s + dt_s } else { f32::INFINITY };
        let is_silent = silence_s > SILENCE_S_MAX;
        let finite = raw.filter(|raw| raw.gyro_rad_s.is_finite() && raw.accel_m_s2.is_finite());
        if let Some(raw) = finite {
            self.silence_s = 0.0;
            self.gyro.push(raw.gyro_rad_s, &GYRO_LIMITS);
            self.accel.push(raw.accel_m_s2, &ACCEL_LIMITS);
        } else {
            // Silence that lasted too long stays so until the next sample, whatever the time.
            self.silence_s = silence_s;
        }
        if raw.is_some() && finite.is_none() {
            return Err(ImuFault::NotFinite);
        }
        if is_silent {
            return Err(ImuFault::Silent);
        }
        self.gyro.judge(&GYRO_LIMITS)?;
        self.accel.judge(&ACCEL_LIMITS)
    }
}

/// Limits of one sensor, in the sensor's unit, with the fault that each limit means.
struct SensorLimits {
    saturated_from: f32,
    most_rms: f32,
    saturated: ImuFault,
    stuck: ImuFault,
    noisy: ImuFault,
}

const GYRO_LIMITS: SensorLimits = SensorLimits {
    saturated_from: SATURATED_GYRO_RAD_S,
    most_rms: NOISY_GYRO_RAD_S,
    saturated: ImuFault::GyroSaturated,
    stuck: ImuFault::GyroStuck,
    noisy: ImuFault::GyroNoisy,
};

const ACCEL_LIMITS: SensorLimits = SensorLimits {
    saturated_from: SATURATED_ACCEL_M_S2,
    most_rms: NOISY_ACCEL_M_S2,
    saturated: ImuFault::AccelSaturated,
    stuck: ImuFault::AccelStuck,
    noisy: ImuFault::AccelNoisy,
};

/// The recent past of one sensor. All values are finite.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct SensorHistory {
    /// The last two values, the newest first; `None` before the first sample.
    last: Option<[Vec3; 2]>,
    /// Number of times that each axis repeated its value.
    repetitions: [u8; 3],
    /// Number of saturated samples in a row.
    saturated: u8,
    /// Running mean square of the high-passed signal by axis.
    mean_square: Vec3,
}

impl SensorHistory {
    fn push(&mut self, value: Vec3, limits: &SensorLimits) {
        let is_saturated = value.abs().max_element() >= limits.saturated_from;
        self.saturated = if is_saturated { self.saturated.saturating_add(1) } else { 0 };
        // The first sample stands for its past, so that the high-pass starts at rest.
        let [newest, older] = self.last.unwrap_or([value, value]);
        if self.last.is_some() {
            let is_same: [bool; 3] = value.cmpeq(newest).into();
            for (count, is_same) in self.repetitions.iter_mut().zip(is_same) {
                *count = if is_same { count.saturating_add(1) } else { 0 };
            }
        }
        let most = Vec3::splat(2.0 * limits.most_rms);
        // Each product is scaled first, so that the largest finite values do not overflow.
        let high_pass = (value * 0.25 - newest * 0.5 + older * 0.25).clamp(-most, most);
        self.mean_square += (high_pass * high_pass - self.mean_square) * MEAN_SQUARE_SHARE;
        self.last = Some([value, newest]);
    }

    fn judge(&self, limits: &SensorLimits) -> Result<(), ImuFault> {
        if self.saturated >= SATURATED_SAMPLES {
            Err(limits.saturated)
        } else if self.repetitions.iter().any(|&count| count >= STUCK_REPETITIONS) {
            Err(limits.stuck)
        } else if self.mean_square.max_element() > limits.most_rms * limits.most_rms {
            Err(limits.noisy)
        } else {
            Ok(())
        }
    }
}

#[cfg(test)]
mod tests;
