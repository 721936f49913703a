//! The cascade of PID controllers: position, velocity, attitude, rate.
