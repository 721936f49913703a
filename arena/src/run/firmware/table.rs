//! The table of the Zooids: from the world's frame to the projector's.

use std::time::Duration;

use bittybuzz_chips::STEP_MM;
use bittybuzz_emulation::message::Command;

use crate::engine::{Pose, wrap};

/// Column and row of the picture's middle, which is that of the world: 56 to 967 and 227 to 796 are projected.
const MIDDLE: [f64; 2] = [511.5, 511.5];

/// Where a robot is at a time and how it moves, in the world's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Since power-on.
    pub since: Duration,
    pub pose: Pose,
    /// mm/s ahead.
    pub speed: f32,
    /// Radians per second, anticlockwise.
    pub turn: f32,
}

/// Less than the code shows: a hundredth of a step.
const NEAR: f32 = 0.01;
/// Radians that move a photodiode by about as much.
const ASIDE: f32 = 0.001;

impl Motion {
    /// mm/s along x and y.
    fn velocity(&self) -> [f32; 2] {
        let (sin, cos) = libm::sincosf(self.pose.heading);
        [self.speed * cos, self.speed * sin]
    }

    /// Whether the emulator knows this, if it was told `other`: it lets robots go straight on while they turn.
    pub fn follows(&self, other: &Motion) -> bool {
        if (self.speed, self.turn) != (other.speed, other.turn) {
            return false;
        }
        let seconds = self.since.saturating_sub(other.since).as_secs_f32();
        let [vx, vy] = other.velocity();
        let (x, y) = (other.pose.x + vx * seconds, other.pose.y + vy * seconds);
        let heading = other.pose.heading + other.turn * seconds;
        (self.pose.x - x).abs() < NEAR
            && (self.pose.y - y).abs() < NEAR
            && wrap(self.pose.heading - heading).abs() < ASIDE
    }

    /// As the emulator is told: in the projector's frame y and headings go the other way.
    pub fn command(&self) -> Command {
        let [vx, vy] = self.velocity().map(f64::from);
        let degrees = |radians: f32| f64::from(radians).to_degrees();
        Command::Place {
            x_mm: MIDDLE[0] * STEP_MM[0] + f64::from(self.pose.x),
            y_mm: MIDDLE[1] * STEP_MM[1] - f64::from(self.pose.y),
            heading_degrees: -degrees(self.pose.heading),
            vx_mm_s: vx,
            vy_mm_s: -vy,
            turn_degrees_s: -degrees(self.turn),
        }
    }
}
