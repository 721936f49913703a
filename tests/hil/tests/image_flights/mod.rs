//! Flights of the image under the disturbances and faults of `robots/crazyflie/physics/tests`, and the
//! figures of docs/flight.md, measured in the same physics. Here the robot's own script flies, and each
//! effect is a command to the emulator.
//!
//! `cargo xtask soak image_flights` runs the long ones, and keeps their figures; CI flies three.

mod backends;
pub mod course;
#[expect(dead_code, reason = "it is the file of another test")]
#[path = "../../../../robots/crazyflie/physics/tests/disturbances/disturbance.rs"]
mod disturbance;
mod disturbances;
mod exhibition;
#[path = "../../../../robots/crazyflie/physics/tests/faults/fault.rs"]
mod fault;
mod faults;
mod figures;
#[path = "../../../../robots/crazyflie/physics/tests/fresh.rs"]
mod fresh;
mod samples;
