//! Zooid: two wheels, tracked by a projector.

use bittybuzz_motion::drive::{Goal, Pilot, Wheels};
use bittybuzz_motion::{Angle, units};

use crate::engine::geometry::{Pose, wrap};
use crate::engine::stream::Stream;

/// What its firmware is told to do with its wheels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Drive {
    /// These duties.
    Wheels(Wheels),
    /// Go there and stay.
    Goal(Goal),
}

impl Default for Drive {
    fn default() -> Self {
        Drive::Wheels(Wheels::default())
    }
}

/// A pose as the firmware reckons with.
pub fn for_firmware(pose: &Pose) -> bittybuzz_motion::track::Pose {
    let length = |mm: f32| units::from_mm(mm).unwrap_or_default();
    let heading = Angle((wrap(pose.heading) * (32_768.0 / core::f32::consts::PI)) as i32 as i16);
    bittybuzz_motion::track::Pose { x: length(pose.x), y: length(pose.y), heading }
}

/// Numbers of the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ZooidModel {
    /// mm
    pub radius: f32,
    /// Between the wheels, mm.
    pub track: f32,
    /// mm/s of a wheel at `full_duty`.
    pub speed: f32,
    /// Duty in percent at which a wheel has `speed`; from `dead_duty` the speed grows linearly.
    pub full_duty: u8,
    /// Duty in percent up to which a wheel stands still.
    pub dead_duty: u8,
    /// Deviation of each wheel's gain, as a part of 1.
    pub gain_sigma: f32,
    /// The size in mm of one step of the projector's code.
    pub unit: f32,
}

impl ZooidModel {
    /// Track and diameter from the makers' description; 0.5 m/s is the reported top speed, 60 the highest duty their
    /// firmware uses, 22 where its calibration begins. No curve of duty and speed is published: linear is a choice, and
    /// so is the deviation.
    pub const STANDARD: Self = ZooidModel {
        radius: 13.0,
        track: 20.0,
        speed: 500.0,
        full_duty: 60,
        dead_duty: 22,
        gain_sigma: 0.05,
        unit: 0.92,
    };
}

/// From the middle to each photodiode, mm (layout of the board, version 1.3).
const DIODE: f32 = 9.8;

/// A projector's frame, seconds: 41 patterns of 333 µs. The robot knows where it was one frame ago.
const FRAME: f32 = 0.013_653;

/// A Zooid's body.
#[derive(Clone, Debug)]
pub(crate) struct Zooid {
    pub(crate) drive: Drive,
    pilot: Pilot,
    /// Where the pilot drives to.
    goal: Option<Goal>,
    gain_left: f32,
    gain_right: f32,
    /// mm/s and radians per second of the last substep.
    speed: f32,
    rate: f32,
    pub(crate) estimate: Pose,
}

impl Zooid {
    pub(crate) fn new(model: &ZooidModel, pose: &Pose, build: &mut Stream) -> Self {
        Zooid {
            drive: Drive::default(),
            pilot: Pilot::new(Some(model.dead_duty)),
            goal: None,
            gain_left: build.gain(model.gain_sigma),
            gain_right: build.gain(model.gain_sigma),
            speed: 0.0,
            rate: 0.0,
            estimate: *pose,
        }
    }

    pub(crate) fn advance(&mut self, pose: &mut Pose, model: &ZooidModel, seconds: f32) {
        let Wheels { left, right } = self.steer(pose);
        self.roll([left, right].map(f32::from), pose, model, seconds);
    }

    /// Its wheels turn for a time; duties in percent.
    pub(crate) fn roll(
        &mut self,
        [left, right]: [f32; 2],
        pose: &mut Pose,
        model: &ZooidModel,
        seconds: f32,
    ) {
        let left = wheel_speed(left, model) * self.gain_left;
        let right = wheel_speed(right, model) * self.gain_right;
        self.speed = (left + right) / 2.0;
        self.rate = (right - left) / model.track;
        if self.speed == 0.0 && self.rate == 0.0 {
            return;
        }
        // An arc: its chord points half the turn further.
        let half = self.rate * seconds / 2.0;
        let chord =
            self.speed * seconds * if half.abs() > 1e-3 { libm::sinf(half) / half } else { 1.0 };
        let (sin, cos) = libm::sincosf(pose.heading + half);
        pose.x += chord * cos;
        pose.y += chord * sin;
        pose.heading = wrap(pose.heading + 2.0 * half);
    }

    /// mm/s ahead and radians per second, anticlockwise, when its wheels last turned.
    pub(crate) fn velocity(&self) -> [f32; 2] {
        [self.speed, self.rate]
    }

    /// The firmware steers 73 times a second by where it reckons to be now, which is off by half a mm: as good as the truth.
    fn steer(&mut self, pose: &Pose) -> Wheels {
        match self.drive {
            Drive::Wheels(wheels) => {
                self.goal = None;
                wheels
            }
            Drive::Goal(goal) => {
                if self.goal.replace(goal) != Some(goal) {
                    self.pilot.depart();
                }
                // What the time is matters only while the least duty is sought.
                self.pilot.steer(goal, &for_firmware(pose), 0)
            }
        }
    }

    /// The position that the robot decodes: its two photodiodes are each in a stripe of the projector's code.
    pub(crate) fn sense(&mut self, pose: &Pose, model: &ZooidModel) {
        let heading = pose.heading - self.rate * FRAME;
        let (sin, cos) = libm::sincosf(heading);
        let (x, y) = (pose.x - self.speed * FRAME * cos, pose.y - self.speed * FRAME * sin);
        // The line between the diodes is square to the heading.
        let stripe = |value: f32| libm::floorf(value / model.unit + 0.5) * model.unit;
        let (left_x, left_y) = (stripe(x - DIODE * sin), stripe(y + DIODE * cos));
        let (right_x, right_y) = (stripe(x + DIODE * sin), stripe(y - DIODE * cos));
        self.estimate = Pose {
            x: (left_x + right_x) / 2.0,
            y: (left_y + right_y) / 2.0,
            z: 0.0,
            heading: libm::atan2f(right_x - left_x, left_y - right_y),
        };
    }
}

/// mm/s of a wheel without its gain error.
fn wheel_speed(duty: f32, model: &ZooidModel) -> f32 {
    let [full, dead] = [model.full_duty, model.dead_duty].map(f32::from);
    let speed = model.speed * (duty.abs().min(full) - dead).max(0.0) / (full - dead);
    if duty < 0.0 { -speed } else { speed }
}
