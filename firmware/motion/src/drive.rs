//! To a goal, from position to position: turns until the goal is ahead, drives the slower the closer it is.

use crate::angle::{Angle, polar};
use crate::track::Pose;
use crate::{Length, MM};

/// Duties of the wheels in percent, -100 (backwards) to 100.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Wheels {
    /// Left wheel.
    pub left: i8,
    /// Right wheel.
    pub right: i8,
}

/// A place to drive to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Goal {
    /// To the right.
    pub x: Length,
    /// Up.
    pub y: Length,
}

/// At this distance the robot has arrived: the goal radius of the makers' manager, 6.5 mm. One that stands leaves again only
/// when it is farther away.
const ARRIVED: Length = 65 * MM / 10;
/// On its way it drives on to this distance.
const CLOSE: Length = 2 * MM;
/// Here a robot that has passed the goal does not turn back.
const PASSED: Length = 5 * MM;

impl Goal {
    /// Returns true if a robot is there.
    pub fn is_reached(self, pose: &Pose) -> bool {
        polar(self.x - pose.x, self.y - pose.y).0 < ARRIVED
    }
}

/// Efforts are in 1/16 of a percent of duty, above the duty at which a wheel begins to turn.
const PERCENT: i32 = 16;
/// The most for driving ahead, and for turning.
const AHEAD_MAX: i32 = 24 * PERCENT;
const TURN_MAX: i32 = 9 * PERCENT;
/// For turning, per angle: 6 percent a radian, here in 2^-16.
const TURN: i32 = 603;
/// The least that is worth anything; a little more is as much as one percent.
const LEAST: i32 = PERCENT / 3;
/// The makers' firmware never asks for more.
const DUTY_MAX: i32 = 60;

/// Angle, 0.5 radians, from which on the robot turns on the spot.
const ASIDE: u16 = 5215;

/// The makers' calibration begins here.
const MINIMUM: u8 = 22;
/// Duty is raised so often while the wheels stand still, µs.
const RAISE_US: u32 = 100_000;
/// The robot has moved, or a wheel has while it turned: more than positions can be off by.
const MOVED: Length = 3 * MM;
/// From the middle to a wheel: 10 mm; in 1/16 mm per 2^16 of an angle in 65536ths of a turn.
const TURNED: i32 = 1005;

/// The knowledge about the duty at which the wheels begin to turn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Minimum {
    /// It.
    Known(u8),
    /// It was not tried yet.
    Unknown,
    /// This was too little until then, at this place.
    Sought { duty: u8, until: u32, from: Pose },
}

/// Drives a robot to goals.
#[derive(Clone, Copy, Debug)]
pub struct Pilot {
    minimum: Minimum,
    /// True if it stands at the goal.
    is_there: bool,
}

impl Pilot {
    /// Returns the drive of a robot whose wheels begin to turn at this duty in percent. `None`
    /// measures it on the way to the first goal.
    pub const fn new(minimum: Option<u8>) -> Self {
        let minimum = match minimum {
            Some(duty) => Minimum::Known(duty),
            None => Minimum::Unknown,
        };
        Pilot { minimum, is_there: false }
    }

    /// There is a new goal.
    pub fn depart(&mut self) {
        self.is_there = false;
    }

    /// The duty at which the wheels begin to turn, once it is known.
    pub const fn minimum(&self) -> Option<u8> {
        match self.minimum {
            Minimum::Known(duty) => Some(duty),
            _ => None,
        }
    }

    /// The duties for a robot that is there at `now` µs.
    pub fn steer(&mut self, goal: Goal, pose: &Pose, now: u32) -> Wheels {
        let (distance, bearing) = pose.sight(goal.x, goal.y);
        let is_behind = bearing.magnitude() > Angle::QUARTER.magnitude();
        self.is_there = match self.is_there {
            true => distance < ARRIVED,
            false => distance < CLOSE || (distance < PASSED && is_behind),
        };
        if self.is_there {
            return Wheels::default();
        }
        let turn = ((bearing.signed() * TURN) >> 16).clamp(-TURN_MAX, TURN_MAX);
        let ahead = if bearing.magnitude() < ASIDE {
            // A quarter of a percent per mm.
            (distance / 4).min(AHEAD_MAX)
        } else {
            0
        };
        let wheel = self.seek(pose, now);
        Wheels { left: wheel(ahead - turn), right: wheel(ahead + turn) }
    }

    /// Returns the function from efforts to duties, with the present knowledge about these.
    fn seek(&mut self, pose: &Pose, now: u32) -> impl Fn(i32) -> i8 + use<> {
        self.minimum = match self.minimum {
            Minimum::Known(duty) => Minimum::Known(duty),
            Minimum::Unknown => {
                let until = now.wrapping_add(RAISE_US);
                Minimum::Sought { duty: MINIMUM, until, from: *pose }
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
                    // It does not move at all, or is held.
                    Minimum::Known(MINIMUM)
                }
            }
        };
        let (minimum, most) = match self.minimum {
            Minimum::Known(duty) => (i32::from(duty), DUTY_MAX),
            Minimum::Sought { duty, .. } => (i32::from(duty), i32::from(duty)),
            Minimum::Unknown => (0, 0),
        };
        move |effort: i32| {
            if effort.abs() < LEAST {
                return 0;
            }
            let duty = ((effort.abs().max(PERCENT) + PERCENT / 2) / PERCENT + minimum).min(most);
            (if effort < 0 { -duty } else { duty }) as i8
        }
    }
}
