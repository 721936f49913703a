//! From the pixels of both photodiodes to the robot's pose, and where it is by now.

use crate::angle::{Angle, polar};
use crate::projector::{ASIDE_US, MIDDLE_US, Pixel};
use crate::{Length, MM};

/// Without a new position for so long the robot is blind, µs.
pub const BLIND_US: u32 = 100_000;

/// The middle of the picture, in halves of a pixel: columns 56 to 967, rows 227 to 796 are projected.
const MIDDLE: [i32; 2] = [56 + 967, 227 + 796];

/// Half a pixel in 2^-16 of a [`Length`]: 883 columns are 812.8 mm, 558 rows are 508 mm (SwarmUI, position_control.c).
const HALF_PIXEL: [i32; 2] = [half_pixel(8128, 883), half_pixel(5080, 558)];

/// Returns half a pixel, in 2^-16 of a [`Length`], where `pixels` pixels are `tenths` tenths of a
/// mm.
const fn half_pixel(tenths: i64, pixels: i64) -> i32 {
    (tenths * MM as i64 * 65_536 / (10 * 2 * pixels)) as i32
}

/// From one photodiode to the other: 19.6 mm (board v1.3), and how much more or less two pixels may make of it, with a robot
/// that turns while it is read.
const BASELINE: Length = 196 * MM / 10;
const TOLERANCE: Length = 4 * MM;

/// Farther than this from where it is expected, a single position is not believed: what it takes to begin to drive, and what
/// the fastest robot drives in the meantime, 0.7 mm in a ms, here in 2^-8 of an estimate's steps.
const LEAP: Length = 12 * MM;
const FASTEST: i32 = 46;

/// Where the robot is, and the direction of its nose, which its antenna is at.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Pose {
    /// To the right.
    pub x: Length,
    /// Up.
    pub y: Length,
    /// Anticlockwise from x.
    pub heading: Angle,
}

impl Pose {
    /// Where it is if photodiode 1, on its right, and 2, on its left, are in these pixels; `None` if that cannot be.
    pub fn of(right: Pixel, left: Pixel) -> Option<Pose> {
        let ([right_x, right_y], [left_x, left_y]) = (place(right), place(left));
        let (apart, to_the_right) = polar(right_x - left_x, right_y - left_y);
        if (apart - BASELINE).abs() > TOLERANCE {
            return None;
        }
        Some(Pose {
            x: (right_x + left_x) / 2,
            y: (right_y + left_y) / 2,
            heading: to_the_right.plus(Angle::QUARTER),
        })
    }

    /// How far another place is, and in which direction as this robot sees it: 0 is ahead, anticlockwise.
    pub fn sight(&self, x: Length, y: Length) -> (Length, Angle) {
        let (distance, direction) = polar(x - self.x, y - self.y);
        (distance, direction.minus(self.heading))
    }
}

/// Of a pixel's middle.
fn place(Pixel { column, row }: Pixel) -> [Length; 2] {
    let [across, down] = [column, row].map(|halves| 2 * i32::from(halves));
    let [right, below] = [across - MIDDLE[0], down - MIDDLE[1]];
    // At most 1023 of them: below 2^31.
    [right * HALF_PIXEL[0], -below * HALF_PIXEL[1]].map(|fixed| (fixed + (1 << 15)) >> 16)
}

/// Bits by which an estimate is finer than what it estimates.
const FINER: u32 = 4;
/// Speeds are per 2^14 µs.
const PER_US: u32 = 14;
/// Times are rounded to 2^4 µs, so that the product with a speed fits: a wheel's 0.5 m/s turns the robot by 50 radians per
/// second.
const COARSER: u32 = 4;

/// A quantity and its speed, by an alpha-beta filter: alpha 3/4, beta 1/2, which is critically damped: beta = 2 (2 - alpha) -
/// 4 sqrt(1 - alpha) (Kalata 1984).
#[derive(Clone, Copy, Debug, Default)]
struct Estimate {
    value: i32,
    speed: i32,
}

impl Estimate {
    /// The value so many µs later.
    fn after(&self, us: i32) -> i32 {
        self.value.wrapping_add((self.speed * (us >> COARSER)) >> (PER_US - COARSER))
    }

    /// A measurement, so many µs after the last, differs by `deviation` from what was expected.
    fn correct(&mut self, us: i32, deviation: i32) {
        self.value = self.after(us).wrapping_add((3 * deviation) >> 2);
        self.speed += (deviation << (PER_US - COARSER - 1)) / (us >> COARSER).max(1);
    }
}

/// Follows a robot.
#[derive(Clone, Copy, Debug, Default)]
pub struct Tracker {
    /// When it was where the estimates say; `None` as long as nothing is known.
    at: Option<u32>,
    x: Estimate,
    y: Estimate,
    /// As an angle does, it wraps around: a whole number of turns is a power of two.
    heading: Estimate,
    /// The last position was not believed.
    is_doubtful: bool,
}

impl Tracker {
    /// Of a robot that is somewhere.
    pub const fn new() -> Self {
        const NOTHING: Estimate = Estimate { value: 0, speed: 0 };
        Tracker { at: None, x: NOTHING, y: NOTHING, heading: NOTHING, is_doubtful: false }
    }

    /// In the frame that began at `start` µs the photodiodes were in these pixels.
    pub fn see(&mut self, start: u32, right: Pixel, left: Pixel) {
        let Some(pose) = Pose::of(right, left) else { return };
        let at = start.wrapping_add(MIDDLE_US);
        let us = self.at.map(|before| at.wrapping_sub(before)).filter(|us| *us <= BLIND_US);
        let Some(us) = us else {
            self.begin(at, pose);
            return;
        };
        let us = us as i32;
        // The column was read before the middle, the row after it.
        let aside = |estimate: &Estimate| (estimate.speed * ASIDE_US as i32) >> PER_US;
        let x = (pose.x << FINER) + aside(&self.x) - self.x.after(us);
        let y = (pose.y << FINER) - aside(&self.y) - self.y.after(us);
        let expected = Angle((self.heading.after(us) >> FINER) as i16);
        let heading = i32::from(pose.heading.minus(expected).0) << FINER;
        let leap = (LEAP << FINER) + ((us * FASTEST) >> 8);
        if x.abs().max(y.abs()) > leap {
            if self.is_doubtful {
                // A second time: somebody has moved the robot.
                self.begin(at, pose);
            } else {
                self.is_doubtful = true;
            }
            return;
        }
        self.is_doubtful = false;
        self.x.correct(us, x);
        self.y.correct(us, y);
        self.heading.correct(us, heading);
        self.at = Some(at);
    }

    fn begin(&mut self, at: u32, pose: Pose) {
        let resting = |value: i32| Estimate { value: value << FINER, speed: 0 };
        *self = Tracker {
            at: Some(at),
            x: resting(pose.x),
            y: resting(pose.y),
            heading: resting(i32::from(pose.heading.0)),
            is_doubtful: false,
        };
    }

    /// Where the robot is at `now` µs, if it is not blind.
    pub fn pose(&mut self, now: u32) -> Option<Pose> {
        let us = now.wrapping_sub(self.at?);
        if us > BLIND_US {
            // Else it would see again when the time has wrapped around.
            self.at = None;
            return None;
        }
        let after = |estimate: &Estimate| estimate.after(us as i32) >> FINER;
        Some(Pose {
            x: after(&self.x),
            y: after(&self.y),
            heading: Angle(after(&self.heading) as i16),
        })
    }
}
