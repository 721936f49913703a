//! The body of a robot that the simulator moves, as `[body]` of its file describes it.
//!
//! Lengths are in mm, speeds in mm/s, and angles in degrees, anticlockwise positive when seen from
//! above. A robot for which the simulator has code has no `[body]`.

use crate::effect::ActuatorQuantity;

/// A body: a disc over the ground with a drive. `[body]` of the robot file.
#[derive(Debug, Clone, PartialEq)]
pub struct BodySpec {
    /// The drive and its limits.
    pub drive: DriveSpec,
    /// Radius of the disc, in mm.
    pub radius_mm: f64,
    /// Height in mm; twice the radius if left out.
    pub height_mm: f64,
    /// Standard deviation of the gain of each actuator, as a share of the gain. It is drawn once
    /// for each actuator of each robot. 0 if left out.
    pub gain_error: f64,
    /// Standard deviation of each speed, as a share of the speed that is set. It is drawn in every
    /// tick. 0 if left out.
    pub noise: f64,
}

/// A drive and its limits. A speed beyond a limit is replaced by the limit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DriveSpec {
    /// Two wheels.
    Differential {
        /// Distance between the wheels, in mm.
        wheel_distance_mm: f64,
        /// Top speed of a wheel over the ground, in mm/s, in both directions.
        speed_mm_s: f64,
        /// The rule by which the wheels follow a vector; `None` if no function steers.
        steering: Option<Steering>,
    },
    /// A forward speed and a turning rate, both reached at once.
    Unicycle {
        /// Top speed, in mm/s, forward and backward.
        speed_mm_s: f64,
        /// Top turning rate, in degrees per second, in both directions.
        turn_deg_s: f64,
    },
    /// Two vibration motors on stiff legs: it never goes backward.
    SlipStick {
        /// Speed with both motors at full duty, in mm/s.
        speed_mm_s: f64,
        /// Turning rate with one motor at full duty, in degrees per second. The right motor alone
        /// turns the robot to the left.
        turn_deg_s: f64,
    },
    /// Four propellers, without their dynamics: the velocities follow the values that are set.
    Quadrotor {
        /// Top speed over the ground, in mm/s.
        speed_mm_s: f64,
        /// Top speed up and down, in mm/s.
        climb_mm_s: f64,
        /// Top turning rate, in degrees per second.
        turn_deg_s: f64,
        /// Time constant, in seconds, with which velocities follow the values that are set; 0.2 if
        /// left out.
        lag_s: f64,
        /// Closing speed in mm/s above which a contact in the air is a crash; 0 if left out, which
        /// makes every contact a crash.
        crash_speed_mm_s: f64,
    },
}

/// The rule by which two wheels follow a vector: that of the Buzz controllers in ARGoS, where these
/// are the attributes of `<wheel_turning>`. `[body.steering]` of the robot file.
///
/// Up to [`no_turn_deg`](Steering::no_turn_deg) off its heading the robot goes straight, and then in
/// a curve that gets narrower with the angle. Above [`hard_turn_deg`](Steering::hard_turn_deg) it
/// turns on the spot, until the angle is [`soft_turn_deg`](Steering::soft_turn_deg) or less.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Steering {
    /// The angle above which the robot turns on the spot, in degrees.
    pub hard_turn_deg: f64,
    /// The angle at which it stops turning on the spot, in degrees.
    pub soft_turn_deg: f64,
    /// The largest angle at which it goes straight, in degrees.
    pub no_turn_deg: f64,
    /// The largest speed along a vector, and that of the wheels in a turn on the spot, in mm/s.
    pub speed_mm_s: f64,
}

impl DriveSpec {
    /// Returns the word in robot files.
    pub const fn name(self) -> &'static str {
        match self {
            DriveSpec::Differential { .. } => "differential",
            DriveSpec::Unicycle { .. } => "unicycle",
            DriveSpec::SlipStick { .. } => "slip-stick",
            DriveSpec::Quadrotor { .. } => "quadrotor",
        }
    }

    /// Returns the rule by which the drive follows a vector; `None` if it has none.
    pub const fn steering(self) -> Option<Steering> {
        match self {
            DriveSpec::Differential { steering, .. } => steering,
            _ => None,
        }
    }

    /// Returns the quantities of motion that the drive has.
    pub const fn quantities(self) -> &'static [ActuatorQuantity] {
        use ActuatorQuantity::{Forward, Height, LeftMotor, LeftWheel, Leftward};
        use ActuatorQuantity::{RightMotor, RightWheel, Turn, Upward};
        match self {
            DriveSpec::Differential { .. } => &[LeftWheel, RightWheel, Forward, Turn],
            DriveSpec::Unicycle { .. } => &[Forward, Turn],
            DriveSpec::SlipStick { .. } => &[LeftMotor, RightMotor],
            DriveSpec::Quadrotor { .. } => &[Forward, Leftward, Upward, Turn, Height],
        }
    }

    /// Returns the largest value of a quantity, in its unit; `None` if it has no limit.
    pub fn most(self, quantity: ActuatorQuantity) -> Option<f64> {
        match quantity {
            ActuatorQuantity::LeftMotor | ActuatorQuantity::RightMotor => Some(1.0),
            ActuatorQuantity::Red | ActuatorQuantity::Green | ActuatorQuantity::Blue => Some(1.0),
            ActuatorQuantity::Height | ActuatorQuantity::Color => None,
            ActuatorQuantity::Upward => match self {
                DriveSpec::Quadrotor { climb_mm_s, .. } => Some(climb_mm_s),
                _ => None,
            },
            ActuatorQuantity::Turn => Some(match self {
                // The fastest turn has the wheels in opposite directions.
                DriveSpec::Differential { wheel_distance_mm, speed_mm_s, .. } => {
                    (2.0 * speed_mm_s / wheel_distance_mm).to_degrees()
                }
                DriveSpec::Unicycle { turn_deg_s, .. }
                | DriveSpec::SlipStick { turn_deg_s, .. }
                | DriveSpec::Quadrotor { turn_deg_s, .. } => turn_deg_s,
            }),
            ActuatorQuantity::LeftWheel
            | ActuatorQuantity::RightWheel
            | ActuatorQuantity::Forward
            | ActuatorQuantity::Leftward => Some(match self {
                DriveSpec::Differential { speed_mm_s, .. }
                | DriveSpec::Unicycle { speed_mm_s, .. }
                | DriveSpec::SlipStick { speed_mm_s, .. }
                | DriveSpec::Quadrotor { speed_mm_s, .. } => speed_mm_s,
            }),
        }
    }
}
