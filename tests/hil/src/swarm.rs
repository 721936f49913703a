//! Several robots whose radios hear each other.
//!
//! The robots run by turns that are no longer than a radio needs from its decision to transmit to the first bit. So all
//! frames that overlap with one on the air are known before its last bit, with which it reaches the others. Two that overlap
//! are both lost. Who transmits is deaf: that is the emulators' business. Other losses are decided here, from a seed.

use std::time::Duration;

use crate::told::Told;
use crate::{Command, Core, Event, Robot, TimedEvent};

/// From reception to transmission (nRF51 reference manual), and a turn.
const RAMP_US: u64 = 130;
const TURN_US: u64 = RAMP_US;
/// Between two packets of the positioning system.
const POSE_PERIOD_US: u64 = 100_000 / TURN_US * TURN_US;
/// Strength of every signal, in -dBm.
const RSSI: u8 = 60;

/// Where a positioning system sees a robot: x, y, z in mm, and the direction of its nose in degrees.
pub type Pose = [f32; 4];

/// Robots in one room.
pub struct Swarm {
    members: Vec<Member>,
    now_us: u64,
    air: Vec<OnAir>,
    loss: f64,
    random: u64,
    /// P2P frames that were on the air, once for each robot that could have heard it.
    pub on_air: u64,
    /// Of these, the ones that were lost on the way.
    pub lost: u64,
    /// And the ones that overlapped with another.
    pub collided: u64,
}

/// A frame on its way.
struct OnAir {
    sender: usize,
    begin: Duration,
    end: Duration,
    port: u8,
    payload: Vec<u8>,
    has_arrived: bool,
}

/// A robot of a swarm.
pub struct Member {
    /// Its emulator.
    pub robot: Robot,
    /// What it told.
    pub told: Told,
    pose: Option<Pose>,
}

impl Swarm {
    /// Crazyflies with this script and these ids.
    pub fn crazyflies(script: &str, ids: &[u16]) -> Self {
        let member = |id: &u16| {
            let mut robot = Robot::crazyflie(Core::Unicorn, script);
            robot.assign_id(*id);
            Member { robot, told: Told::of_crazyflie(), pose: None }
        };
        let members = ids.iter().map(member).collect();
        let air = vec![];
        Swarm { members, now_us: 0, air, loss: 0.0, random: 1, on_air: 0, lost: 0, collided: 0 }
    }

    /// From now on frames are lost with this probability, for each receiver on its own; equal seeds lose the same.
    pub fn lose(&mut self, probability: f64, seed: u64) {
        self.loss = probability;
        // Xorshift knows no zero, and begins slowly with few bits.
        self.random = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    }

    /// The robots.
    pub fn members(&mut self) -> &mut [Member] {
        &mut self.members
    }

    /// From now on the positioning system sees a robot there, or not at all.
    pub fn place(&mut self, member: usize, pose: Option<Pose>) {
        self.members[member].pose = pose;
    }

    /// Runs for so many ms.
    pub fn run_ms(&mut self, ms: u64) {
        let end = self.now_us + 1000 * ms;
        while self.now_us < end {
            let turn = TURN_US.min(end - self.now_us);
            if self.now_us.is_multiple_of(POSE_PERIOD_US) {
                self.tell_poses();
            }
            self.now_us += turn;
            for (sender, member) in self.members.iter_mut().enumerate() {
                for TimedEvent { at, event } in member.run_us(turn) {
                    if let Event::P2p { port, payload, air } = event {
                        let (begin, end) = (at + Duration::from_micros(RAMP_US), at + air);
                        self.air.push(OnAir {
                            sender,
                            begin,
                            end,
                            port,
                            payload,
                            has_arrived: false,
                        });
                    }
                }
            }
            self.carry();
        }
    }

    fn tell_poses(&mut self) {
        for member in &mut self.members {
            if let Some([x_mm, y_mm, z_mm, yaw_degrees]) = member.pose {
                member.robot.tell(&Command::Pose { x_mm, y_mm, z_mm, yaw_degrees });
            }
        }
    }

    /// Frames that end before the next turn does go to all others.
    fn carry(&mut self) {
        let now = Duration::from_micros(self.now_us);
        let next = now + Duration::from_micros(TURN_US);
        for number in 0..self.air.len() {
            let OnAir { sender, begin, end, port, .. } = self.air[number];
            if end > next || self.air[number].has_arrived {
                continue;
            }
            self.air[number].has_arrived = true;
            for receiver in (0..self.members.len()).filter(|receiver| *receiver != sender) {
                self.on_air += 1;
                // To its own frames the receiver is deaf anyway.
                let overlaps = |other: &OnAir| {
                    ![sender, receiver].contains(&other.sender)
                        && other.begin < end
                        && begin < other.end
                };
                if self.air.iter().any(overlaps) {
                    self.collided += 1;
                } else if self.chance() < self.loss {
                    self.lost += 1;
                } else {
                    let payload = self.air[number].payload.clone();
                    let command = Command::P2p { at: end, port, rssi: RSSI, payload };
                    self.members[receiver].robot.tell(&command);
                }
            }
        }
        // The longest frame is on the air for 0.3 ms.
        self.air.retain(|frame| frame.end + Duration::from_millis(1) > now);
    }

    /// Xorshift: from 0 to 1.
    fn chance(&mut self) -> f64 {
        self.random ^= self.random << 13;
        self.random ^= self.random >> 7;
        self.random ^= self.random << 17;
        (self.random >> 11) as f64 / (1_u64 << 53) as f64
    }
}

impl Member {
    fn run_us(&mut self, us: u64) -> Vec<TimedEvent> {
        let events = self.robot.run_us(us);
        for event in &events {
            if let Event::Rtt { bytes } = &event.event {
                self.told.read(bytes);
            }
        }
        events
    }

    /// The values that the script logged last.
    pub fn last_logged(&self) -> Option<&[String]> {
        self.told.log.last().map(|(_, values)| values.as_slice())
    }
}
