//! Calibration of the inertial sensors while the robot stands still.
