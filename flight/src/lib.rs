//! Flight of a small quadrotor: from samples of its sensors to the power of its motors.
//!
//! # Principles
//! 1. **No chip and no clock.** The caller passes samples, measurements and the time; every function
//!    finishes in bounded time, without allocation. So the host runs the same code as the robot.
//! 2. **Nothing from outside is trusted.** Measurements pass a gate before they change the estimate,
//!    commands are limited to what the robot can do, and a number that is not finite is refused.
//! 3. **Safety does not depend on the script.** The [`supervisor`] alone decides if motors may turn,
//!    and the [`pilot`] arms only with the permission of a person.
//! 4. **Equations have a source.** The documentation of a module names the paper or data sheet.
//!
//! # Frames and units
//! SI units; angles in radians. The world frame has x and y on the ground and z upwards; the body
//! frame has x ahead, y to the left and z upwards. Both are right-handed, so a positive pitch lowers
//! the nose. An attitude is the rotation from the body frame to the world frame. Accelerometers
//! measure the specific force: a robot that stands on the ground measures +9.81 m/s² along z.
//! Names of fields carry the unit, such as `_m_s` for m/s.
//!
//! # Motors
//! Seen from above, motor 1 is at the front right, and motors 2, 3 and 4 follow clockwise; arrays
//! start with motor 1. Motors 1 and 3 turn such that their reaction torque about z is negative,
//! motors 2 and 4 positive.
//!
//! # Not included
//! Drivers, the radio and the machine of the script belong to the firmware. Nothing here was tried on
//! hardware.

#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

pub mod arbiter;
pub mod avoidance;
pub mod blind;
mod bounds;
pub mod calibration;
pub mod ekf;
pub mod filter;
pub mod geometric;
pub mod mixer;
pub mod motor;
pub mod pilot;
pub mod planner;
pub mod polynomial;
pub mod stack;
mod state;
pub mod supervisor;
pub mod trust;
mod vehicle;

pub use glam::{Mat3, Quat, Vec2, Vec3};
pub use state::{FlightState, ImuSample, MotorDuties, MotorForces, Reference, Wrench};
pub use vehicle::Vehicle;

/// Standard gravity in m/s².
pub const GRAVITY_M_S2: f32 = 9.81;
