//! A script that takes off and flies in random directions.

use std::f32::consts::PI;

use bittybuzz_flight::planner::{VelocityCommand, VelocityFrame};
use bittybuzz_flight::{FlightState, Vec3};
use bittybuzz_random::Random;

/// Ticks of 1 ms between commands, as of a script that runs 10 times per second.
pub const COMMAND_TICKS: u64 = 100;
/// Commands of one leg.
const LEG_COMMANDS: u64 = 12;

/// A pilot.
pub struct Pilot {
    random: Random,
    commands: u64,
    velocity_m_s: Vec3,
    height_m: f32,
}

impl Pilot {
    pub fn new(random: Random) -> Self {
        Pilot { random, commands: 0, velocity_m_s: Vec3::ZERO, height_m: 0.5 }
    }

    fn between(&mut self, least: f32, most: f32) -> f32 {
        let unit = self.random.unit_f32();
        least + (most - least) * unit
    }

    /// Returns the next command of a flight at heights of 0.5 to 1 m.
    pub fn command(&mut self, estimate: &FlightState) -> VelocityCommand {
        if self.commands.is_multiple_of(LEG_COMMANDS) {
            self.height_m = self.between(0.5, 1.0);
            let speed = self.between(0.1, 0.9);
            let course = self.between(-PI, PI);
            self.velocity_m_s = Vec3::new(speed * course.cos(), speed * course.sin(), 0.0);
        }
        self.commands += 1;
        let climb = ((self.height_m - estimate.position_m.z) * 2.0).clamp(-0.4, 0.4);
        // No leg begins before the robot has left the ground.
        let along = if self.commands <= LEG_COMMANDS { Vec3::ZERO } else { self.velocity_m_s };
        VelocityCommand {
            frame: VelocityFrame::World,
            velocity_m_s: along.with_z(climb),
            yaw_rate_rad_s: 0.3,
        }
    }
}
