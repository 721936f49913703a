//! The body of a robot that the simulator moves, as `[body]` of its file describes it.
//!
//! Lengths are in mm, speeds in mm/s, angles in degrees, positive anticlockwise seen from above. A robot with code of its
//! own for the simulator has no `[body]`.

use crate::effect::Quantity;

/// A body: a disc over the ground with a drive. `[body]` of the robot file.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// The drive and its limits.
    pub drive: Drive,
    /// Radius of the disc, in mm.
    pub radius_mm: f64,
    /// Height in mm; twice the radius if left out.
    pub height_mm: f64,
    /// Standard deviation of the gain of each actuator, as a share of it: drawn once for each actuator of each robot. 0 if
    /// left out.
    pub gain_error: f64,
    /// Standard deviation of each speed around the speed that is set, as a share of it: drawn in every tick. 0 if left out.
    pub noise: f64,
}

/// A drive and its limits. A speed beyond a limit becomes the limit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Drive {
    /// Two wheels.
    Differential {
        /// From wheel to wheel, in mm.
        wheel_distance_mm: f64,
        /// Fastest speed of a wheel over the ground, in mm/s, in both directions.
        speed_mm_s: f64,
    },
    /// A forward speed and a turning rate, both reached at once.
    Unicycle {
        /// Fastest, in mm/s, forward and backward.
        speed_mm_s: f64,
        /// Fastest, in degrees per second, in both directions.
        turn_deg_s: f64,
    },
    /// Two vibration motors on stiff legs: it never goes backward.
    SlipStick {
        /// With both motors at full duty, in mm/s.
        speed_mm_s: f64,
        /// With one motor at full duty, in degrees per second. The right motor alone turns it to the left.
        turn_deg_s: f64,
    },
    /// Four propellers, without their dynamics: velocities follow those that are set.
    Quadrotor {
        /// Fastest over the ground, in mm/s.
        speed_mm_s: f64,
        /// Fastest up and down, in mm/s.
        climb_mm_s: f64,
        /// Fastest, in degrees per second.
        turn_deg_s: f64,
        /// Time constant with which velocities follow those that are set, in seconds; 0.2 if left out.
        lag_s: f64,
        /// Closing speed in mm/s above which a contact in the air is a crash; 0 if left out: every contact is one.
        crash_speed_mm_s: f64,
    },
}

impl Drive {
    /// The word of robot files.
    pub const fn name(self) -> &'static str {
        match self {
            Drive::Differential { .. } => "differential",
            Drive::Unicycle { .. } => "unicycle",
            Drive::SlipStick { .. } => "slip-stick",
            Drive::Quadrotor { .. } => "quadrotor",
        }
    }

    /// The quantities of motion that it has.
    pub const fn quantities(self) -> &'static [Quantity] {
        use Quantity::{Forward, Height, LeftMotor, LeftWheel, Leftward};
        use Quantity::{RightMotor, RightWheel, Turn, Upward};
        match self {
            Drive::Differential { .. } => &[LeftWheel, RightWheel, Forward, Turn],
            Drive::Unicycle { .. } => &[Forward, Turn],
            Drive::SlipStick { .. } => &[LeftMotor, RightMotor],
            Drive::Quadrotor { .. } => &[Forward, Leftward, Upward, Turn, Height],
        }
    }

    /// The largest value of a quantity, in its unit; `None` if it has no limit.
    pub fn most(self, quantity: Quantity) -> Option<f64> {
        match quantity {
            Quantity::LeftMotor | Quantity::RightMotor => Some(1.0),
            Quantity::Red | Quantity::Green | Quantity::Blue => Some(1.0),
            Quantity::Height | Quantity::Color => None,
            Quantity::Upward => match self {
                Drive::Quadrotor { climb_mm_s, .. } => Some(climb_mm_s),
                _ => None,
            },
            Quantity::Turn => Some(match self {
                // With the wheels in opposite directions.
                Drive::Differential { wheel_distance_mm, speed_mm_s } => {
                    (2.0 * speed_mm_s / wheel_distance_mm).to_degrees()
                }
                Drive::Unicycle { turn_deg_s, .. }
                | Drive::SlipStick { turn_deg_s, .. }
                | Drive::Quadrotor { turn_deg_s, .. } => turn_deg_s,
            }),
            Quantity::LeftWheel | Quantity::RightWheel | Quantity::Forward | Quantity::Leftward => {
                Some(match self {
                    Drive::Differential { speed_mm_s, .. }
                    | Drive::Unicycle { speed_mm_s, .. }
                    | Drive::SlipStick { speed_mm_s, .. }
                    | Drive::Quadrotor { speed_mm_s, .. } => speed_mm_s,
                })
            }
        }
    }
}
