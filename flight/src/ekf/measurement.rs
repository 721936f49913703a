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
