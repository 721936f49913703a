//! Several robots whose radios hear each other.

use std::time::Duration;

use bittybuzz_arena::run::{P2P_EXCHANGE_PERIOD, P2pAir};

use crate::trace_log::TraceLog;
use crate::{Command, Core, EmulatorEvent, Robot, TimedEvent};

const P2P_EXCHANGE_PERIOD_US: u64 = P2P_EXCHANGE_PERIOD.as_micros() as u64;
/// Between two packets of the positioning system.
const POSE_PERIOD_US: u64 = 100_000 / P2P_EXCHANGE_PERIOD_US * P2P_EXCHANGE_PERIOD_US;

/// Where a positioning system sees a robot: x, y, z in mm, and the direction of its nose in degrees.
pub type Pose = [f32; 4];

/// Robots in one room.
pub struct Swarm {
    members: Vec<Member>,
    now_us: u64,
    /// The air between them.
    pub air: P2pAir,
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
        Swarm { members, now_us: 0, air: P2pAir::default() }
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
        // A robot alone has nothing to wait for.
        let longest = if self.members.len() == 1 { POSE_PERIOD_US } else { P2P_EXCHANGE_PERIOD_US };
        while self.now_us < end {
            let turn = longest.min(end - self.now_us);
            if self.now_us.is_multiple_of(POSE_PERIOD_US) {
                self.send_poses();
            }
            self.now_us += turn;
            for (sender, member) in self.members.iter_mut().enumerate() {
                for TimedEvent { at, event } in member.run_us(turn) {
                    if let EmulatorEvent::P2p { port, payload, air } = event {
                        self.air.send(sender, at, air, port, payload);
                    }
                }
            }
            let now = Duration::from_micros(self.now_us);
            for (receiver, command) in self.air.carry(now, self.members.len(), |_, _| true) {
                self.members[receiver].robot.execute(&command);
            }
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
    fn run_us(&mut self, us: u64) -> Vec<TimedEvent> {
        let events = self.robot.run_us(us);
        for event in &events {
            if let EmulatorEvent::Rtt { bytes } = &event.event {
                self.trace_log.read(bytes);
            }
        }
        events
    }

    /// The values that the script logged last.
    pub fn last_logged(&self) -> Option<&[String]> {
        self.trace_log.log.last().map(|(_, values)| values.as_slice())
    }
}
