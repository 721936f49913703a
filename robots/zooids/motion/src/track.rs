//! The tracker: computes the robot's pose from the pixels of both photodiodes, and extrapolates it
//! to the present.

use crate::angle::{Angle, polar};
use crate::projector::{AXIS_OFFSET_US, MIDDLE_US, Pixel};
use crate::{Length, MM};

/// The time in µs without a new position after which the robot is blind.
pub const BLIND_US: u32 = 100_000;

/// The middle of the picture, in half pixels. Columns 56 to 967 and rows 227 to 796 are projected.
const MIDDLE: [i32; 2] = [56 + 967, 227 + 796];

/// Half a pixel in 2^-16 of a [`Length`]: 883 columns are 812.8 mm, 558 rows are 508 mm (SwarmUI, position_control.c).
const HALF_PIXEL: [i32; 2] = [half_pixel(8128, 883), half_pixel(5080, 558)];

/// Returns half a pixel, in 2^-16 of a [`Length`], where `pixels` pixels are `tenths` tenths of a
/// mm.
const fn half_pixel(tenths: i64, pixels: i64) -> i32 {
    (tenths * MM as i64 * 65_536 / (10 * 2 * pixels)) as i32
}

/// The distance between the photodiodes, 19.6 mm (board v1.3), and the tolerance of its measurement
/// from two pixels while the robot turns.
const BASELINE: Length = 196 * MM / 10;
const TOLERANCE: Length = 4 * MM;

/// The distance from the expected position beyond which a single position is rejected. It is the
/// sum of the error when the robot begins to drive, and of the path of the fastest robot since the
/// last position, 0.7 mm per ms, here in 2^-8 of an estimate's steps.
const JUMP_MAX: Length = 12 * MM;
const FASTEST: i32 = 46;

/// The position of the robot and the direction of its nose, where its antenna is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct TrackedPose {
    /// The coordinate to the right.
    pub x: Length,
    /// The coordinate upwards.
    pub y: Length,
    /// The direction of the nose, anticlockwise from x.
    pub heading: Angle,
}

impl TrackedPose {
    /// Returns the pose of a robot with photodiode 1, on its right, and 2, on its left, in these
    /// pixels. Returns `None` if the distance between the pixels is impossible.
    pub fn of(right: Pixel, left: Pixel) -> Option<TrackedPose> {
        let ([right_x, right_y], [left_x, left_y]) = (place(right), place(left));
        let (apart, to_the_right) = polar(right_x - left_x, right_y - left_y);
        if (apart - BASELINE).abs() > TOLERANCE {
            return None;
        }
        Some(TrackedPose {
            x: (right_x + left_x) / 2,
            y: (right_y + left_y) / 2,
            heading: to_the_right.plus(Angle::QUARTER),
        })
    }

    /// Returns the distance and the direction of another place from this robot. Direction 0 is
    /// ahead, and angles count anticlockwise.
    pub fn sight(&self, x: Length, y: Length) -> (Length, Angle) {
        let (distance, direction) = polar(x - self.x, y - self.y);
        (distance, direction.minus(self.heading))
    }
}

/// Returns the coordinates of a pixel's middle.
fn place(Pixel { column, row }: Pixel) -> [Length; 2] {
    let [across, down] = [column, row].map(|halves| 2 * i32::from(halves));
    let [right, below] = [across - MIDDLE[0], down - MIDDLE[1]];
    // There are at most 1023 half pixels, so the products are below 2^31.
    [right * HALF_PIXEL[0], -below * HALF_PIXEL[1]].map(|fixed| (fixed + (1 << 15)) >> 16)
}

/// The number of bits by which an estimate is finer than the estimated quantity.
const FRACTION_BITS: u32 = 4;
/// Speeds are in units per 2^14 µs.
const SPEED_TIME_BITS: u32 = 14;
/// Times are rounded to 2^4 µs, so that the product with a speed does not overflow: a wheel's 0.5
/// m/s turns the robot by 50 radians per second.
const TIME_ROUNDING_BITS: u32 = 4;

/// A quantity and its speed, estimated by an alpha-beta filter. With alpha 3/4 and beta 1/2 it is
/// critically damped: beta = 2 (2 - alpha) - 4 sqrt(1 - alpha) (Kalata 1984).
#[derive(Clone, Copy, Debug, Default)]
struct Estimate {
    value: i32,
    speed: i32,
}

impl Estimate {
    /// Returns the value `us` µs later.
    fn after(&self, us: i32) -> i32 {
        self.value.wrapping_add(
            (self.speed * (us >> TIME_ROUNDING_BITS)) >> (SPEED_TIME_BITS - TIME_ROUNDING_BITS),
        )
    }

    /// Corrects the estimate by a measurement `us` µs after the last one, which differs by
    /// `deviation` from the expected value.
    fn correct(&mut self, us: i32, deviation: i32) {
        self.value = self.after(us).wrapping_add((3 * deviation) >> 2);
        self.speed += (deviation << (SPEED_TIME_BITS - TIME_ROUNDING_BITS - 1))
            / (us >> TIME_ROUNDING_BITS).max(1);
    }
}

/// The estimate of a robot's pose and speeds.
#[derive(Clone, Copy, Debug, Default)]
pub struct Tracker {
    /// The time in µs of the estimates; `None` while the pose is unknown.
    at: Option<u32>,
    x: Estimate,
    y: Estimate,
    /// The heading, which wraps around like an angle, because a whole turn is a power of two.
    heading: Estimate,
    /// True if the last position was rejected.
    is_doubtful: bool,
}

impl Tracker {
    /// Returns the tracker of a robot whose pose is unknown.
    pub const fn new() -> Self {
        const NOTHING: Estimate = Estimate { value: 0, speed: 0 };
        Tracker { at: None, x: NOTHING, y: NOTHING, heading: NOTHING, is_doubtful: false }
    }

    /// Processes the pixels that the photodiodes decoded from the frame that began at `start` µs.
    pub fn see(&mut self, start: u32, right: Pixel, left: Pixel) {
        let Some(pose) = TrackedPose::of(right, left) else { return };
        let at = start.wrapping_add(MIDDLE_US);
        let us = self.at.map(|before| at.wrapping_sub(before)).filter(|us| *us <= BLIND_US);
        let Some(us) = us else {
            self.begin(at, pose);
            return;
        };
        let us = us as i32;
        // The column was measured before the middle of the frame's code, and the row after it.
        let aside =
            |estimate: &Estimate| (estimate.speed * AXIS_OFFSET_US as i32) >> SPEED_TIME_BITS;
        let x = (pose.x << FRACTION_BITS) + aside(&self.x) - self.x.after(us);
        let y = (pose.y << FRACTION_BITS) - aside(&self.y) - self.y.after(us);
        let expected = Angle((self.heading.after(us) >> FRACTION_BITS) as i16);
        let heading = i32::from(pose.heading.minus(expected).0) << FRACTION_BITS;
        let leap = (JUMP_MAX << FRACTION_BITS) + ((us * FASTEST) >> 8);
        if x.abs().max(y.abs()) > leap {
            if self.is_doubtful {
                // Two positions in a row were far from the expected one: the robot was moved by
                // hand.
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

    fn begin(&mut self, at: u32, pose: TrackedPose) {
        let resting = |value: i32| Estimate { value: value << FRACTION_BITS, speed: 0 };
        *self = Tracker {
            at: Some(at),
            x: resting(pose.x),
            y: resting(pose.y),
            heading: resting(i32::from(pose.heading.0)),
            is_doubtful: false,
        };
    }

    /// Returns the robot's pose at `now` µs, unless the robot is blind.
    pub fn pose(&mut self, now: u32) -> Option<TrackedPose> {
        let us = now.wrapping_sub(self.at?);
        if us > BLIND_US {
            // The old estimate would become valid again after the time has wrapped around.
            self.at = None;
            return None;
        }
        let after = |estimate: &Estimate| estimate.after(us as i32) >> FRACTION_BITS;
        Some(TrackedPose {
            x: after(&self.x),
            y: after(&self.y),
            heading: Angle(after(&self.heading) as i16),
        })
    }
}
