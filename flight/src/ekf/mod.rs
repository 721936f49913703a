//! The extended Kalman filter of position, velocity and attitude.
