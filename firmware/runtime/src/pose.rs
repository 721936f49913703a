//! The robot's pose from a positioning system, and the locations of other robots relative to it.

use core::cell::Cell;

use bittybuzz_vm_core::number::maths::{self, MathFunction};
use bittybuzz_vm_core::number::{Float, Full, Profile};
use bittybuzz_vm_core::{Axis, ByteCode, Value};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_time::{Duration, Instant};

/// The time for which a pose is valid.
pub const VALID: Duration = Duration::from_secs(1);

/// The position of the robot and the direction of its nose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// x, y and z (up) in mm.
    pub position_mm: [f32; 3],
    /// The direction of the nose on the ground, x and y. The length of this vector does not matter.
    heading: [f32; 2],
}

/// The latest pose, with the time at which it was set.
pub struct LatestPose(Mutex<CriticalSectionRawMutex, Cell<Option<(Pose, Instant)>>>);

impl LatestPose {
    /// Returns a cell without a pose.
    pub const fn new() -> Self {
        LatestPose(Mutex::new(Cell::new(None)))
    }

    /// Sets the robot's present pose.
    pub fn set(&self, pose: Pose) {
        self.0.lock(|latest| latest.set(Some((pose, Instant::now()))));
    }

    /// Returns the robot's pose, unless it is too old.
    pub fn get(&self) -> Option<Pose> {
        let (pose, at) = self.0.lock(Cell::get)?;
        (at.elapsed() <= VALID).then_some(pose)
    }
}

impl Default for LatestPose {
    fn default() -> Self {
        Self::new()
    }
}

impl Pose {
    /// Converts a position in m and a rotation from the robot's frame (x ahead, y to the left) to
    /// the world's, which is a quaternion x, y, z, w.
    pub fn new(position_m: [f32; 3], [x, y, z, w]: [f32; 4]) -> Self {
        let ahead = [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z)];
        Pose { position_mm: position_m.map(|m| m * 1000.0), heading: ahead }
    }

    /// Returns a coordinate as scripts read it: mm, or degrees. `C` is the byte code type of the
    /// robot's virtual machine, so that both share the code of `atan2`.
    pub fn along<C: ByteCode>(&self, axis: Axis) -> f32 {
        let ([x, y, z], [ahead_x, ahead_y]) = (self.position_mm, self.heading);
        match axis {
            Axis::X => x,
            Axis::Y => y,
            Axis::Z => z,
            Axis::Orientation => atan2::<C>(ahead_y, ahead_x).to_degrees(),
        }
    }

    /// Returns the location of another robot at this position (mm) relative to this robot: the
    /// distance in mm, the azimuth in (-pi, pi] and the elevation, both in radians. The azimuth
    /// counts from the nose, anticlockwise. A tilt of the robot is ignored.
    pub fn place_of<P: Profile, C: ByteCode>(&self, other_mm: [f32; 3]) -> [Value<P>; 3] {
        let ([x, y, z], [ahead_x, ahead_y]) = (self.position_mm, self.heading);
        let [dx, dy, dz] = [other_mm[0] - x, other_mm[1] - y, other_mm[2] - z];
        let ahead = dx * ahead_x + dy * ahead_y;
        let left = dy * ahead_x - dx * ahead_y;
        let ground = sqrt::<C>(dx * dx + dy * dy);
        let azimuth = match atan2::<C>(left, ahead) {
            behind if behind <= -maths::PI => maths::PI,
            azimuth => azimuth,
        };
        let distance = sqrt::<C>(ground * ground + dz * dz);
        [distance, azimuth, atan2::<C>(dz, ground)].map(Value::float)
    }
}

fn sqrt<C: ByteCode>(x: f32) -> f32 {
    calculate::<C>(MathFunction::Sqrt, x, 0.0)
}

fn atan2<C: ByteCode>(y: f32, x: f32) -> f32 {
    calculate::<C>(MathFunction::Atan2, y, x)
}

/// Calculates with the functions of scripts, whose results are equal on every robot.
fn calculate<C: ByteCode>(function: MathFunction, first: f32, second: f32) -> f32 {
    let mut result = Float::from_f32(first);
    maths::function::<Full, C>(function as u8, &mut result, &Float::from_f32(second));
    result.to_f32()
}
