//! The steering to a goal: turns until the goal is ahead, and drives more slowly the closer the
//! goal is.

use crate::angle::{Angle, polar};
use crate::track::TrackedPose;
use crate::{Length, MM};

/// The duties of the wheels in percent, -100 (backwards) to 100.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Wheels {
    pub left: i8,
    pub right: i8,
}

/// A place to drive to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Goal {
    /// The coordinate to the right.
    pub x: Length,
    /// The coordinate upwards.
    pub y: Length,
}

/// The distance at which the robot has arrived: the goal radius of the makers' manager, 6.5 mm. A
/// robot that stands at the goal leaves only when it is farther away.
const GOAL_RADIUS: Length = 65 * MM / 10;
/// The distance at which a driving robot stops.
const STOP_DISTANCE: Length = 2 * MM;
/// The distance within which a robot that has passed the goal does not turn back.
const PASSED_DISTANCE: Length = 5 * MM;

impl Goal {
    /// Returns true if a robot at this pose has arrived.
    pub fn is_reached(self, pose: &TrackedPose) -> bool {
        polar(self.x - pose.x, self.y - pose.y).0 < GOAL_RADIUS
    }
}

/// A percent of duty in units of effort. Efforts count above the duty at which a wheel begins to
/// turn.
const PERCENT: i32 = 16;
/// The highest efforts for driving ahead and for turning.
const AHEAD_MAX: i32 = 24 * PERCENT;
const TURN_MAX: i32 = 9 * PERCENT;
/// The effort for turning per angle: 6 percent per radian, here in 2^-16.
const TURN_GAIN: i32 = 603;
/// The lowest effort that turns a wheel. An effort between this and one percent counts as one
/// percent.
const EFFORT_MIN: i32 = PERCENT / 3;
/// The highest duty in percent, which is that of the makers' firmware.
const DUTY_MAX: i32 = 60;

/// The angle (0.5 radians) from which on the robot turns on the spot.
const SPOT_TURN_ANGLE: u16 = 5215;

/// The duty in percent at which the makers' calibration begins.
const DUTY_START: u8 = 22;
/// The interval in µs at which the duty is raised while the wheels stand still.
const RAISE_US: u32 = 100_000;
/// The distance by which the robot must move, or a wheel must move while the robot turns. It is
/// larger than the errors of positions.
const MOVED: Length = 3 * MM;
/// The distance from the middle to a wheel, 10 mm, as the wheel's path: in 1/16 mm per 2^16 of an
/// angle in 65536ths of a turn.
const TURNED: i32 = 1005;

/// The state of the measurement of the duty at which the wheels begin to turn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Minimum {
    /// The measured or configured duty in percent.
    Known(u8),
    /// The measurement has not begun.
    Unknown,
    /// The duty that is being tried until the time `until`, for a robot that stood at `from`.
    Sought { duty: u8, until: u32, from: TrackedPose },
}

/// Drives a robot to goals.
#[derive(Clone, Copy, Debug)]
pub struct Pilot {
    minimum: Minimum,
    /// True if the robot stands at the goal.
    is_there: bool,
}

impl Pilot {
    /// Returns the pilot of a robot whose wheels begin to turn at this duty in percent. With
    /// `None`, the pilot measures the duty on the way to the first goal.
    pub const fn new(minimum: Option<u8>) -> Self {
        let minimum = match minimum {
            Some(duty) => Minimum::Known(duty),
            None => Minimum::Unknown,
        };
        Pilot { minimum, is_there: false }
    }

    /// Starts the way to a new goal.
    pub fn depart(&mut self) {
        self.is_there = false;
    }

    /// Returns the duty in percent at which the wheels begin to turn, once it is known.
    pub const fn minimum(&self) -> Option<u8> {
        match self.minimum {
            Minimum::Known(duty) => Some(duty),
            _ => None,
        }
    }

    /// Returns the duties for a robot that is at `pose` at `now` µs.
    pub fn steer(&mut self, goal: Goal, pose: &TrackedPose, now: u32) -> Wheels {
        let (distance, bearing) = pose.sight(goal.x, goal.y);
        let is_behind = bearing.magnitude() > Angle::QUARTER.magnitude();
        self.is_there = match self.is_there {
            true => distance < GOAL_RADIUS,
            false => distance < STOP_DISTANCE || (distance < PASSED_DISTANCE && is_behind),
        };
        if self.is_there {
            return Wheels::default();
        }
        let turn = ((bearing.signed() * TURN_GAIN) >> 16).clamp(-TURN_MAX, TURN_MAX);
        let ahead = if bearing.magnitude() < SPOT_TURN_ANGLE {
            // The effort is a quarter of a percent per mm.
            (distance / 4).min(AHEAD_MAX)
        } else {
            0
        };
        let wheel = self.seek(pose, now);
        Wheels { left: wheel(ahead - turn), right: wheel(ahead + turn) }
    }

    /// Continues the measurement of the minimum duty, and returns the function from efforts to
    /// duties.
    fn seek(&mut self, pose: &TrackedPose, now: u32) -> impl Fn(i32) -> i8 + use<> {
        self.minimum = match self.minimum {
            Minimum::Known(duty) => Minimum::Known(duty),
            Minimum::Unknown => {
                let until = now.wrapping_add(RAISE_US);
                Minimum::Sought { duty: DUTY_START, until, from: *pose }
            }
            Minimum::Sought { duty, until, from } => {
                let (moved, _) = polar(pose.x - from.x, pose.y - from.y);
                let turned =
                    (i32::from(pose.heading.minus(from.heading).magnitude()) * TURNED) >> 16;
                if moved.max(turned) > MOVED {
                    Minimum::Known(duty)
                } else if (now.wrapping_sub(until) as i32) < 0 {
                    Minimum::Sought { duty, until, from }
                } else if i32::from(duty) < DUTY_MAX {
                    Minimum::Sought { duty: duty + 1, until: until.wrapping_add(RAISE_US), from }
                } else {
                    // The robot does not move at all, or it is held.
                    Minimum::Known(DUTY_START)
                }
            }
        };
        let (minimum, most) = match self.minimum {
            Minimum::Known(duty) => (i32::from(duty), DUTY_MAX),
            Minimum::Sought { duty, .. } => (i32::from(duty), i32::from(duty)),
            Minimum::Unknown => (0, 0),
        };
        move |effort: i32| {
            if effort.abs() < EFFORT_MIN {
                return 0;
            }
            let duty = ((effort.abs().max(PERCENT) + PERCENT / 2) / PERCENT + minimum).min(most);
            (if effort < 0 { -duty } else { duty }) as i8
        }
    }
}
