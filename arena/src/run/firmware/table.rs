//! The conversion of poses and motions from the world's frame to that of an emulator, which is the
//! projector's: y and headings have the opposite sign.

use std::time::Duration;

use bittybuzz_emulation::message::Command;

use crate::engine::{Pose, wrap};

/// The pose and motion of a robot at a time, in the world's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Time since power-on.
    pub since: Duration,
    pub pose: Pose,
    /// Forward speed in mm/s.
    pub speed_mm_s: f32,
    /// Turn rate in radians per second, anticlockwise.
    pub turn_rad_s: f32,
}

/// A distance in mm that the projector's code cannot show: a hundredth of a step.
const DISTANCE_TOLERANCE_MM: f32 = 0.01;
/// An angle in radians that moves a photodiode by about [`DISTANCE_TOLERANCE_MM`].
const ANGLE_TOLERANCE_RAD: f32 = 0.001;

impl Motion {
    /// Returns the velocity along x and y in mm/s.
    fn velocity(&self) -> [f32; 2] {
        let (sin, cos) = libm::sincosf(self.pose.heading);
        [self.speed_mm_s * cos, self.speed_mm_s * sin]
    }

    /// Returns true if the emulator, which was sent `other`, already predicts this motion. The
    /// emulator extrapolates straight and turning motion.
    pub fn is_predicted_by(&self, other: &Motion) -> bool {
        if (self.speed_mm_s, self.turn_rad_s) != (other.speed_mm_s, other.turn_rad_s) {
            return false;
        }
        let seconds = self.since.saturating_sub(other.since).as_secs_f32();
        let [vx, vy] = other.velocity();
        let (x, y) = (other.pose.x + vx * seconds, other.pose.y + vy * seconds);
        let heading = other.pose.heading + other.turn_rad_s * seconds;
        (self.pose.x - x).abs() < DISTANCE_TOLERANCE_MM
            && (self.pose.y - y).abs() < DISTANCE_TOLERANCE_MM
            && wrap(self.pose.heading - heading).abs() < ANGLE_TOLERANCE_RAD
    }

    /// Returns the command that places a robot. The argument is the middle of the world in the
    /// emulator's frame, in mm.
    pub fn command(&self, [x, y]: [f64; 2]) -> Command {
        let [vx, vy] = self.velocity().map(f64::from);
        let degrees = |radians: f32| f64::from(radians).to_degrees();
        Command::Place {
            x_mm: x + f64::from(self.pose.x),
            y_mm: y - f64::from(self.pose.y),
            heading_degrees: -degrees(self.pose.heading),
            vx_mm_s: vx,
            vy_mm_s: -vy,
            turn_degrees_s: -degrees(self.turn_rad_s),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_motion_as_predicted_needs_no_command() {
        let sent = Motion {
            since: Duration::from_millis(100),
            pose: Pose::new(10.0, 20.0, 1.0),
            speed_mm_s: 200.0,
            turn_rad_s: 0.0,
        };
        let later = |pose: Pose| Motion { since: Duration::from_millis(110), pose, ..sent };
        let (sin, cos) = 1.0_f32.sin_cos();
        let there = Pose::new(10.0 + 2.0 * cos, 20.0 + 2.0 * sin, 1.0);
        assert!(later(there).is_predicted_by(&sent));
        assert!(!later(Pose { x: there.x + 0.1, ..there }).is_predicted_by(&sent));
        assert!(!later(Pose { heading: 1.01, ..there }).is_predicted_by(&sent));
        assert!(!Motion { speed_mm_s: 190.0, ..later(there) }.is_predicted_by(&sent));
    }

    /// In the projector's frame y points down, and headings grow from x to y.
    #[test]
    fn the_y_axis_of_the_projector_points_down() {
        let pose = Pose::new(-30.0, 40.0, core::f32::consts::FRAC_PI_2);
        let motion = Motion { since: Duration::ZERO, pose, speed_mm_s: 100.0, turn_rad_s: 0.5 };
        let Command::Place { x_mm, y_mm, heading_degrees, vx_mm_s, vy_mm_s, turn_degrees_s } =
            motion.command([500.0, 400.0])
        else {
            panic!("it is placed")
        };
        assert!((x_mm - 470.0).abs() < 1e-6 && (y_mm - 360.0).abs() < 1e-6);
        assert!((heading_degrees + 90.0).abs() < 1e-4 && (turn_degrees_s + 28.648).abs() < 1e-3);
        assert!(vx_mm_s.abs() < 1e-3 && (vy_mm_s + 100.0).abs() < 1e-3);
    }
}
