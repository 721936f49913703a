//! Measurements that the Kalman filter accepts, and the outcome of an update.

use glam::{Quat, Vec3};

/// A position from outside, such as from motion capture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PositionMeasurement {
    /// Position in the world frame, in m.
    pub position_m: Vec3,
    /// Standard deviation of each axis, in m; above 0.
    pub sigma_m: f32,
    /// Time since the measurement was true, in seconds; 0 or more.
    pub age_s: f32,
}

/// A position and an attitude from outside, such as from motion capture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseMeasurement {
    /// Position in the world frame, in m.
    pub position_m: Vec3,
    /// Rotation from the body frame to the world frame; a squared length of 0.5 to 2.
    pub attitude: Quat,
    /// Standard deviation of each axis of the position, in m; above 0.
    pub sigma_m: f32,
    /// Standard deviation of the attitude about each axis, in rad; above 0.
    pub sigma_rad: f32,
    /// Time since the measurement was true, in seconds; 0 or more.
    pub age_s: f32,
}

/// The motion of the ground's picture in a downward camera with the optics of the PMW3901.
///
/// The counts are integers of the sensor, turned into body axes: positive when the robot moves
/// along the positive axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlowMeasurement {
    /// Counts along body x.
    pub counts_x: f32,
    /// Counts along body y.
    pub counts_y: f32,
    /// Standard deviation of each axis without quantization, in counts; above 0.
    pub sigma_counts: f32,
    /// Time over which the sensor counted, in seconds; above 0 and at most 0.1.
    pub seconds: f32,
}

/// Readings of the PMW3901 about the surface below it, in the same burst as the counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FlowSurface {
    /// Number of features that the sensor sees, divided by 4 (register SQUAL).
    pub quality: u8,
    /// Time of exposure in cycles of the sensor's clock (registers SHUTTER).
    pub shutter: u16,
}

/// Quality below which, with the longest exposure, a picture shows no motion (PixArt's application
/// note on the PMW3901, recalled). Such a sensor counts too little or nothing.
const QUALITY_MIN: u8 = 0x19;
const SHUTTER_MAX: u16 = 0x1f00;

impl FlowSurface {
    /// Returns the standard deviation of counts over this surface, or `None` if they are not usable.
    ///
    /// The noise by the exposure is that of crazyflie-firmware 2a18fc29 (`flowdeck_v1v2.c`).
    #[must_use]
    pub fn sigma_counts(&self) -> Option<f32> {
        let shows_motion = self.quality >= QUALITY_MIN || self.shutter < SHUTTER_MAX;
        shows_motion.then_some(7.984e-4 * f32::from(self.shutter) + 0.4335)
    }
}

/// A reason why the filter did not use a measurement or a sample at all.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EkfRefusal {
    /// A number is infinite or not a number.
    NotFinite,
    /// A number is outside its documented range.
    OutOfRange,
    /// The measurement is older than the past that the filter remembers.
    TooOld,
    /// The robot tilts too much for this sensor.
    TooTilted,
}

/// The result of an update.
#[derive(Clone, Copy, Debug, PartialEq)]
#[must_use]
pub enum EkfOutcome {
    /// The measurement changed the estimate.
    Accepted,
    /// The measurement contradicts the estimate and changed nothing.
    Rejected {
        /// Squared Mahalanobis distance of the innovation, divided by the limit; above 1.
        distance_ratio: f32,
    },
    /// The measurement cannot be used and changed nothing.
    Refused(EkfRefusal),
}

impl EkfOutcome {
    /// Returns true when the measurement changed the estimate.
    pub fn is_accepted(&self) -> bool {
        *self == EkfOutcome::Accepted
    }
}

/// Checks that a standard deviation is finite and above 0.
pub(super) fn check_sigma(sigma: f32) -> Result<(), EkfRefusal> {
    if !sigma.is_finite() {
        Err(EkfRefusal::NotFinite)
    } else if sigma <= 0.0 {
        Err(EkfRefusal::OutOfRange)
    } else {
        Ok(())
    }
}

/// Checks that an age is finite and not negative.
pub(super) fn check_age(age_s: f32) -> Result<(), EkfRefusal> {
    if !age_s.is_finite() {
        Err(EkfRefusal::NotFinite)
    } else if age_s < 0.0 {
        Err(EkfRefusal::OutOfRange)
    } else {
        Ok(())
    }
}

/// Checks that a quaternion is finite and nearly of length 1, as a rotation is.
pub(super) fn check_attitude(attitude: Quat) -> Result<(), EkfRefusal> {
    if !attitude.is_finite() {
        Err(EkfRefusal::NotFinite)
    } else if !(0.5..=2.0).contains(&attitude.length_squared()) {
        Err(EkfRefusal::OutOfRange)
    } else {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dark_surface_is_noisy_and_one_without_features_is_refused() {
        let sigma = |quality, shutter| FlowSurface { quality, shutter }.sigma_counts();
        assert!((sigma(80, 1962).unwrap() - 2.0).abs() < 1e-3);
        assert!(sigma(80, 100).unwrap() < 0.6);
        assert!(sigma(0x18, 0x1eff).is_some() && sigma(0x19, u16::MAX).is_some());
        assert_eq!(sigma(0x18, 0x1f00), None);
    }
}
