//! Flights of the whole flight controller in the physics: noisy sensors, vibration, motors that
//! differ, and a battery that sags.
//!
//! Figures are about the true state of the body unless a test says otherwise. They begin 5 s after
//! the command to take off.

mod capture;
mod commands;
pub mod consistency;
pub mod figures;
mod flow;
mod hand_over;
mod legs;
mod path;
pub mod rig;
