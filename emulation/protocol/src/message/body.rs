//! The surroundings and the faults of a Crazyflie's body in the physics.

use serde::{Deserialize, Serialize};

/// The air and the floor around a body.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Room {
    /// Mean velocity of the air in m/s.
    pub wind_m_s: [f64; 3],
    /// Standard deviation of each coordinate of the gusts in m/s; 0 for a steady wind.
    pub gusts_m_s: f64,
    /// Time of correlation of the gusts in seconds.
    pub gust_s: f64,
    /// Start of the pseudo-random sequence of the gusts.
    pub seed: u64,
    /// Force on the body in N.
    pub force_n: [f64; 3],
    /// Height of the floor in mm.
    pub floor_mm: f64,
}

impl Default for Room {
    /// Returns calm air above the floor at 0.
    fn default() -> Self {
        Room {
            wind_m_s: [0.0; 3],
            gusts_m_s: 0.0,
            gust_s: 0.8,
            seed: 0,
            force_n: [0.0; 3],
            floor_mm: 0.0,
        }
    }
}

/// The errors of the poses that motion capture sends a body.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PoseErrors {
    /// Time in ms until a pose arrives.
    pub latency_ms: u32,
    /// Probability that a pose is lost on its way, besides the usual 1 %.
    pub lose: f64,
    /// Start of the pseudo-random sequence of these losses.
    pub seed: u64,
    /// Displacement of all poses in mm.
    pub jump_mm: [f64; 3],
    /// Turn of the room's frame about its z axis in degrees.
    pub turn_degrees: f64,
    /// Turn of the markers on the robot in degrees, as a vector along its axis.
    pub marker_turn_degrees: [f64; 3],
}

impl Default for PoseErrors {
    /// Returns poses as a body gets them from its start on.
    fn default() -> Self {
        PoseErrors {
            latency_ms: 10,
            lose: 0.0,
            seed: 0,
            jump_mm: [0.0; 3],
            turn_degrees: 0.0,
            marker_turn_degrees: [0.0; 3],
        }
    }
}

/// The motors of a body, and their power.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Powertrain {
    /// The share of its thrust that each motor has.
    pub thrust_shares: [f64; 4],
    /// The share of its charge that the battery has left; missing to leave the battery as it is.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub charge: Option<f64>,
}

impl Default for Powertrain {
    /// Returns whole motors.
    fn default() -> Self {
        Powertrain { thrust_shares: [1.0; 4], charge: None }
    }
}

/// A sensor of a body, as the physics has it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BodySensor {
    /// Gyroscope and accelerometer.
    Inertial,
    /// The flow sensor of a Flow deck.
    Flow,
    /// The distance sensor of a Flow deck.
    Distance,
    /// The motion capture in the room.
    Poses,
}

/// A fault of the measurements of a sensor. Faults of its chip are those of
/// [`DeviceFault`](super::DeviceFault).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MeasurementFault {
    /// The sensor repeats its last measurement.
    Stuck,
    /// The noise is larger by this factor.
    Noisy(f64),
    /// The sensor measures nothing: a chip keeps its last value, and no pose is sent.
    Silent,
}
