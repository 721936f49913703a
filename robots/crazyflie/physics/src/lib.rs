//! The physics of a Crazyflie: a rigid body with four rotors, a battery, the air around it, the
//! ground below it, and its sensors.
//!
//! # Purpose
//! It takes the place of the real robot under a flight controller: duties of the motors go in, and
//! measurements of sensors come out. It does not depend on that controller, so an error in one does
//! not hide in the other. Walls, other robots and the radio belong to the arena.
//!
//! # Principles
//! 1. **Equal numbers everywhere.** Functions such as the sine come from `libm`, vectors use scalar
//!    arithmetic, and random numbers come from a seed. A run repeats bit by bit, natively and as
//!    WebAssembly.
//! 2. **A fixed step of a millisecond**, the period of the inertial sensors and of the flight controller.
//!    All differential equations are integrated with the Runge-Kutta method of order 4.
//! 3. **Each number has a source.** [`Airframe`]'s module and the settings of each sensor say if a
//!    value was read, recalled or chosen.
//! 4. **The whole state is visible.** Every part implements `Clone`, `PartialEq` and a complete
//!    `Debug`, so that a digest of the text is a digest of the state.
//! 5. **Inputs cannot break it.** Numbers that are not finite or absurd are limited.
//!
//! # Use
//! ```
//! use bittybuzz_crazyflie_physics::sensors::SensorSuite;
//! use bittybuzz_crazyflie_physics::{Airframe, Drone, DroneSurroundings};
//!
//! let airframe = Airframe::CRAZYFLIE_2_1_PLUS;
//! // Without a controller, only a robot with equal motors stays upright; `Drone::new` draws them.
//! let mut drone = Drone::nominal(airframe);
//! let mut sensors = SensorSuite::new(&airframe, 1);
//! let surroundings = DroneSurroundings::default();
//! for _ in 0..1000 {
//!     drone.step([0.8; 4], &surroundings);
//!     if let Some(counts) = sensors.imu.sample(drone.state()) {
//!         assert!(counts.accel_m_s2().is_finite());
//!     }
//! }
//! assert!(drone.state().position_m.z > 0.1 && drone.battery_volts() < 4.2);
//! ```
//!
//! # Frames and units
//! SI units, angles in radians, rotor speeds in rpm. The world frame has x and y on the ground and z
//! upwards; the body frame has x ahead, y to the left and z upwards; both are right-handed. Motor 1 is
//! ahead on the right, 2 behind on the right, 3 behind on the left, 4 ahead on the left; the reaction
//! torque about z of 1 and 3 is negative.
//!
//! # Simplifications
//! * Thrust depends on the rotor's speed only: no inflow, no blade flapping, no vortex ring. Drag is
//!   linear in the velocity.
//! * The response of a rotor was measured at the voltages of flight. Below, and at standstill, it is
//!   a choice.
//! * The battery has one resistance and no recovery. Its current depends on the thrust only.
//! * The ground is flat and level below each robot. Springs of contact are softer than plastic.
//! * Downwash and ground effect are formulas of another simulator with limits.
//! * Wind is the same at the whole robot, and blows on it near the ground too.
//! * Sensors sit at the center of mass.
//! * A crash does not break anything: the caller decides what follows.
//!
//! # Cost
//! The example `step_cost` measures a robot with its inertial sensors; a robot on the ground costs
//! more than one in the air, because of its contact.
//!
//! # Not tried on hardware
//! Nothing here was compared with a flight of a real robot. Parameters come from published
//! identifications; accelerations and rates of fast maneuvers are the least certain.

#![forbid(unsafe_code)]

mod aerodynamics;
mod airframe;
mod battery;
mod drone;
mod dynamics;
mod ground;
mod random;
pub mod sensors;
mod state;
mod wind;

pub use aerodynamics::{downwash_n, ground_effect};
pub use airframe::{Airframe, SpinResponse};
pub use battery::{BatteryCell, PowerSource};
pub use drone::{Drone, DroneSurroundings};
pub use glam::{DMat3, DQuat, DVec2, DVec3};
pub use ground::{CrashCause, GroundContact, Impact, LANDING_SPEED_M_S_MAX, LANDING_TILT_RAD_MAX};
pub use state::DroneState;
pub use wind::{Wind, WindSettings};

/// Standard gravity in m/s², rounded as in the flight controller.
pub const GRAVITY_M_S2: f64 = 9.81;
/// Duration of a step in seconds.
pub const STEP_S: f64 = 0.001;
