//! A Crazyflie with a body in a room with motion capture.

use crate::{Command, Core, Robot};

/// Time in ms after power-on at which the sensors run and the script does, too.
const STARTED_MS: u64 = 2_000;

/// Returns the command that gives a robot a body at the origin, and poses of usual motion capture 100
/// times per second.
pub fn captured_body(seed: u64) -> Command {
    Command::Body {
        seed,
        x_mm: 0.0,
        y_mm: 0.0,
        yaw_degrees: 0.0,
        pose_ms: 10,
        pose_noise_mm: 0.5,
        pose_noise_degrees: 0.3,
    }
}

/// Returns a robot with such a body, two seconds after power-on.
pub fn standing(script: &str, seed: u64) -> Robot {
    let mut robot = Robot::crazyflie(Core::Unicorn, script);
    robot.execute(&captured_body(seed));
    robot.run_ms(STARTED_MS);
    robot
}
