//! Several robots whose radios hear each other.

use std::time::Duration;

use bittybuzz_arena::run::{RadioTurns, TurnLength};

use crate::trace_log::TraceLog;
use crate::{Command, Core, Emulator, EmulatorEvent, Robot, RobotEvent};

/// The time between two packets of the positioning system: 769 turns of 130 µs.
const POSE_PERIOD_US: u64 = 99_970;

/// Where a positioning system sees a robot: x, y, z in mm, and the direction of its nose in degrees.
pub type Pose = [f32; 4];

/// Robots in one room.
pub struct Swarm {
    members: Vec<Member>,
    now_us: u64,
    /// Their turns, and the air between them.
    pub radio: RadioTurns,
}

/// A robot of a swarm.
pub struct Member {
    /// Its emulator.
    pub robot: Robot,
    /// The messages of its firmware and its script.
    pub trace_log: TraceLog,
    pose: Option<Pose>,
}

impl Swarm {
    /// Crazyflies with this script and these ids.
    pub fn crazyflies(script: &str, ids: &[u16]) -> Self {
        let member = |id: &u16| {
            let mut robot = Robot::crazyflie(Core::Unicorn, script);
            robot.assign_id(*id);
            Member { robot, trace_log: TraceLog::of_crazyflie(), pose: None }
        };
        let members = ids.iter().map(member).collect();
        Swarm { members, now_us: 0, radio: RadioTurns::new(TurnLength::Exact) }
    }

    /// The robots.
    pub fn members(&mut self) -> &mut [Member] {
        &mut self.members
    }

    /// From now on the positioning system sees a robot there, or not at all.
    pub fn place(&mut self, member: usize, pose: Option<Pose>) {
        self.members[member].pose = pose;
    }

    /// The time since power-on in ms.
    pub fn now_ms(&self) -> u64 {
        self.now_us / 1000
    }

    /// Runs for so many ms.
    pub fn run_ms(&mut self, ms: u64) {
        let end = self.now_us + 1000 * ms;
        while self.now_us < end {
            if self.now_us.is_multiple_of(POSE_PERIOD_US) {
                self.send_poses();
            }
            let pose_us = (self.now_us / POSE_PERIOD_US + 1) * POSE_PERIOD_US;
            self.now_us = end.min(pose_us);
            self.run_until(Duration::from_micros(self.now_us));
        }
    }

    fn run_until(&mut self, until: Duration) {
        let mut events = Vec::new();
        let members = self.members.iter_mut();
        let mut robots: Vec<&mut Emulator> =
            members.map(|member| member.robot.emulator_until(until)).collect();
        let run = self.radio.run(&mut robots, until, |_, _| true, |event| events.push(event));
        run.expect("they run");
        for RobotEvent { robot, timed } in events {
            let member = &mut self.members[robot];
            if let EmulatorEvent::Rtt { bytes } = &timed.event {
                member.trace_log.read(bytes);
            }
            member.robot.events.push(timed);
        }
    }

    fn send_poses(&mut self) {
        for member in &mut self.members {
            if let Some([x_mm, y_mm, z_mm, yaw_degrees]) = member.pose {
                member.robot.execute(&Command::Pose { x_mm, y_mm, z_mm, yaw_degrees });
            }
        }
    }
}

impl Member {
    /// The values that the script logged last.
    pub fn last_logged(&self) -> Option<&[String]> {
        self.trace_log.log.last().map(|(_, values)| values.as_slice())
    }
}
