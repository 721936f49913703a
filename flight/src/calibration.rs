//! Calibration of the inertial sensors while the robot stands still, and their supervision in
//! flight.
//!
//! [`ImuCalibrator`] collects samples at rest and finds the bias of the gyroscope and the scale of
//! the accelerometer. [`ImuCalibration`] applies them. [`ImuMonitor`] finds a sensor that fails in
//! flight.
//!
//! # Acceptance
//! A window of 512 samples at 1 kHz is accepted if the robot did not move, stood nearly level, and
//! both sensors gave plausible values. Each limit is a constant of this module with its reason; the
//! figures of the sensor come from the data sheet of the BMI088 (BST-BMI088-DS001).
//!
//! The window needs no memory for its samples: mean and variance come from Welford's recursion.
//!
//! # Limits
//! A steady turn about the vertical below 3 °/s looks like a bias, because nothing else measures
//! yaw at rest. One position cannot tell the scale of the accelerometer from its offset; the scale
//! makes the norm right for a robot that hovers.

mod monitor;
#[cfg(test)]
mod simulated_imu;
mod window;

use glam::Vec3;

pub use monitor::{ImuFault, ImuMonitor};
use window::RestWindow;

use crate::{GRAVITY_M_S2, ImuSample};

/// Number of samples in a window: 0.512 s at 1 kHz.
pub const CALIBRATION_SAMPLES: u16 = 512;

/// Largest variance of the angular rate about each axis, in (rad/s)².
///
/// The limit is 100 LSB² at a full scale of 2000 °/s, as in the Crazyflie's firmware.
///
/// The sensor's own noise is 0.16 °/s rms (0.014 °/s/√Hz at a bandwidth of 116 Hz), which is 7 % of
/// this limit; a robot in a hand exceeds it.
pub const GYRO_VARIANCE_RAD2_S2_MAX: f32 = 1.134_8e-4;

/// Largest bias about each axis, in rad/s (3 °/s).
///
/// The data sheet gives 1 °/s as the typical offset, and 0.015 °/s/K as its drift (0.9 °/s over
/// 60 K).
pub const CALIBRATED_BIAS_RAD_S_MAX: f32 = 0.052_36;

/// Largest variance of the specific force along each axis, in (m/s²)²: 0.1 m/s² rms.
///
/// The sensor's own noise is 0.022 m/s² rms (190 µg/√Hz at a bandwidth of 145 Hz).
pub const ACCEL_VARIANCE_M2_S4_MAX: f32 = 0.01;

/// Largest relative difference between the mean specific force and gravity.
///
/// The data sheet gives an offset of 20 mg (2 %); ten times a normal error is a broken sensor or a
/// wrong range.
pub const GRAVITY_ERROR_MAX: f32 = 0.1;

/// Largest tilt in radians (15°).
///
/// A floor and the legs of a robot are flatter; a robot on its side or in a hand is not.
pub const CALIBRATION_TILT_RAD_MAX: f32 = 0.261_8;

/// The bias of the gyroscope and the scale of the accelerometer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuCalibration {
    gyro_bias_rad_s: Vec3,
    accel_scale: f32,
}

impl ImuCalibration {
    /// The calibration of perfect sensors, which changes nothing.
    pub const IDENTITY: Self = ImuCalibration { gyro_bias_rad_s: Vec3::ZERO, accel_scale: 1.0 };

    /// Returns the sample without bias and with the right scale.
    pub fn apply(&self, raw: &ImuSample) -> ImuSample {
        ImuSample {
            gyro_rad_s: raw.gyro_rad_s - self.gyro_bias_rad_s,
            accel_m_s2: raw.accel_m_s2 * self.accel_scale,
        }
    }

    /// Returns the bias of the gyroscope in rad/s, at most 3 °/s about each axis.
    pub fn gyro_bias_rad_s(&self) -> Vec3 {
        self.gyro_bias_rad_s
    }

    /// Returns the factor that gives the specific force at rest the norm of gravity, 0.9 to 1.12.
    pub fn accel_scale(&self) -> f32 {
        self.accel_scale
    }
}

/// A reason why a window of samples gives no calibration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CalibrationRefusal {
    /// A sample was not finite.
    NotFinite,
    /// One axis of the gyroscope gave the same value in the whole window.
    GyroStuck,
    /// One axis of the accelerometer gave the same value in the whole window.
    AccelStuck,
    /// The angular rate varied: the robot moved.
    Turning,
    /// The mean angular rate exceeds the sensor's bias: the robot turned steadily.
    BiasTooLarge,
    /// The specific force varied: the robot moved.
    Shaking,
    /// The norm of the specific force differs too much from gravity.
    WrongGravity,
    /// The robot does not stand level.
    Tilted,
}

/// The progress of a calibration.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ImuCalibrator(CalibrationProgress);

#[derive(Clone, Copy, Debug, PartialEq)]
enum CalibrationProgress {
    Calibrating(RestWindow),
    Calibrated(ImuCalibration),
}

impl Default for CalibrationProgress {
    fn default() -> Self {
        CalibrationProgress::Calibrating(RestWindow::default())
    }
}

impl ImuCalibrator {
    /// Returns a calibrator without samples.
    pub fn new() -> Self {
        ImuCalibrator::default()
    }

    /// Processes a sample as the sensor measured it, before filters.
    ///
    /// The result is `None` until a window is complete. After calibration, samples are ignored.
    ///
    /// # Errors
    /// Returns the reason if the window that this sample completes is not accepted. A sample that
    /// is not finite ends its window at once. The next sample starts a new window.
    pub fn update(
        &mut self,
        raw: &ImuSample,
    ) -> Result<Option<ImuCalibration>, CalibrationRefusal> {
        let CalibrationProgress::Calibrating(window) = &mut self.0 else {
            return Ok(self.calibration());
        };
        if !(raw.gyro_rad_s.is_finite() && raw.accel_m_s2.is_finite()) {
            *self = ImuCalibrator::new();
            return Err(CalibrationRefusal::NotFinite);
        }
        window.push(raw);
        if window.samples() < CALIBRATION_SAMPLES {
            return Ok(None);
        }
        let judgment = judge(window);
        self.0 = judgment
            .map_or_else(|_| CalibrationProgress::default(), CalibrationProgress::Calibrated);
        judgment.map(Some)
    }

    /// Returns the calibration, or `None` while no window was accepted.
    pub fn calibration(&self) -> Option<ImuCalibration> {
        match self.0 {
            CalibrationProgress::Calibrating(_) => None,
            CalibrationProgress::Calibrated(calibration) => Some(calibration),
        }
    }
}

/// Returns the calibration that a complete window gives.
fn judge(window: &RestWindow) -> Result<ImuCalibration, CalibrationRefusal> {
    let gyro_variance = window.gyro_variance_rad2_s2();
    let accel_variance = window.accel_variance_m2_s4();
    let gyro_bias_rad_s = window.gyro_mean_rad_s();
    let accel_m_s2 = window.accel_mean_m_s2();
    let gravity_m_s2 = accel_m_s2.length();
    let is_gravity = (gravity_m_s2 - GRAVITY_M_S2).abs() <= GRAVITY_ERROR_MAX * GRAVITY_M_S2;
    let is_level = accel_m_s2.z >= gravity_m_s2 * libm::cosf(CALIBRATION_TILT_RAD_MAX);
    // Each condition is false for NaN, so that an overflow is refused.
    let is_within = |value: Vec3, most: f32| value.abs().cmple(Vec3::splat(most)).all();
    if window.is_gyro_stuck() {
        Err(CalibrationRefusal::GyroStuck)
    } else if window.is_accel_stuck() {
        Err(CalibrationRefusal::AccelStuck)
    } else if !is_within(gyro_variance, GYRO_VARIANCE_RAD2_S2_MAX) {
        Err(CalibrationRefusal::Turning)
    } else if !is_within(accel_variance, ACCEL_VARIANCE_M2_S4_MAX) {
        Err(CalibrationRefusal::Shaking)
    } else if !is_within(gyro_bias_rad_s, CALIBRATED_BIAS_RAD_S_MAX) {
        Err(CalibrationRefusal::BiasTooLarge)
    } else if !is_gravity {
        Err(CalibrationRefusal::WrongGravity)
    } else if !is_level {
        Err(CalibrationRefusal::Tilted)
    } else {
        Ok(ImuCalibration { gyro_bias_rad_s, accel_scale: GRAVITY_M_S2 / gravity_m_s2 })
    }
}

#[cfg(test)]
mod tests;
