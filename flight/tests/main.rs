//! The tests of this crate, as one program, so that they are linked once.

#![allow(clippy::unwrap_used, reason = "a failure here fails the test")]

mod avoidance;
mod common;
mod control;
mod ekf_behavior;
mod ekf_consistency;
mod ekf_nine_states;
mod hostile;
mod oracle_control;
mod oracle_ekf;
mod oracle_filters;
mod oracle_planner;
mod recorded_flights;
mod vectors;
