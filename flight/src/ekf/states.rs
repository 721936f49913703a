//! The order of the error's states.

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
