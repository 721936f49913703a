//! The physics of a Crazyflie: a rigid body with four rotors, a battery, the air around it, the
//! ground below it, and its sensors.

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

pub use aerodynamics::{downwash_n, ground_effect};
pub use airframe::{Airframe, SpinResponse};
pub use battery::{BatteryCell, PowerSource};
pub use drone::{Drone, DroneSurroundings};
pub use glam::{DMat3, DQuat, DVec2, DVec3};
pub use ground::{
    CrashCause, GroundContact, Impact, MOST_LANDING_SPEED_M_S, MOST_LANDING_TILT_RAD,
};
pub use state::DroneState;

/// Standard gravity in m/s², rounded as in the flight controller.
pub const GRAVITY_M_S2: f64 = 9.81;
/// Duration of a step in seconds.
pub const STEP_S: f64 = 0.0005;
