//! Swarm messages over P2P broadcast.

use core::sync::atomic::Ordering;

use bittybuzz_comms::syslink::{P2P_MAX, Ping, Position, SWARM_PORT, SwarmFrame, SyslinkPacket};
use bittybuzz_runtime::liveness::{BEAT, Pulse};
use bittybuzz_runtime::mail::Mail;
use bittybuzz_vm_core::Sighting;
use bittybuzz_vm_core::number::Rng;
use embassy_time::{Duration, Instant, Timer};

use super::send::send;
use super::{POSE, STATE};
use crate::robot::{FRAME_BYTES, IN_LONG, IN_QUEUE, Numbers, OUT_LONG, OUT_QUEUE};
use crate::section::Section;
use crate::settings;
use bittybuzz_board::log;

/// The messages that wait for the script, and those that wait for the radio.
pub static MAIL: Mail<Numbers, FRAME_BYTES, IN_QUEUE, OUT_QUEUE, IN_LONG, OUT_LONG> = Mail::new();

/// The minimum time between two answers to pings, so that pings do not keep the radio busy.
const ANSWER_PERIOD: Duration = Duration::from_millis(100);

/// Receives swarm messages and pings.
pub struct SwarmReceiver {
    robot_id: u16,
    /// True once the log reported that another robot has this one's id.
    has_reported: bool,
    /// The time from which on the next ping may be answered.
    next_answer: Instant,
}

impl SwarmReceiver {
    /// Returns the receiver of the robot with this id.
    pub fn new(robot_id: u16) -> Self {
        SwarmReceiver { robot_id, has_reported: false, next_answer: Instant::MIN }
    }

    /// Handles the data of a P2P frame on the port of swarm messages. The sender's location is
    /// computed now, because both robots may have moved by the next step.
    pub fn process(&mut self, data: &[u8]) {
        let Some(SwarmFrame { robot, position, message }) = SwarmFrame::parse(data) else {
            match Ping::parse(data) {
                Some(ping) if ping.is_answer => self.compare_id(ping.robot),
                Some(ping) => self.answer(ping),
                None => {
                    STATE.unknown.fetch_add(1, Ordering::Relaxed);
                }
            }
            return;
        };
        self.compare_id(robot);
        let place = match (POSE.get(), position) {
            (Some(here), Some(there)) => Some(here.place_of::<Numbers, Section>(there.mm())),
            _ => None,
        };
        MAIL.add_received(message, Sighting { robot: Some(robot), place });
    }

    /// Counts a sender that has this robot's id, and reports the first one.
    fn compare_id(&mut self, robot: u16) {
        if robot != self.robot_id {
            return;
        }
        STATE.same_id.fetch_add(1, Ordering::Relaxed);
        if !self.has_reported {
            self.has_reported = true;
            log::warning!("another robot has id {=u16}, too: `bbz flash --id`", robot);
        }
    }

    fn answer(&mut self, ping: Ping<'_>) {
        let now = Instant::now();
        if ping.robot != self.robot_id || now < self.next_answer {
            return;
        }
        self.next_answer = now + ANSWER_PERIOD;
        let answer = Ping { is_answer: true, ..ping };
        if let Some(data) = answer.write(&mut [0; P2P_MAX]) {
            send(&SyslinkPacket::P2pSend { port: SWARM_PORT, data });
        }
    }
}

/// Runs the task that broadcasts the script's messages.
#[embassy_executor::task]
pub async fn broadcast_messages(robot_id: u16, pulse: Pulse) -> ! {
    // The chip's hash is part of the seed. Robots that have the same id by mistake therefore send
    // at different times, and can detect each other.
    let rng = Rng::new(settings::chip(), robot_id);
    while !STATE.can_send() {
        pulse.beat();
        Timer::after(BEAT).await;
    }
    MAIL.drain(rng, pulse, |message| {
        if !STATE.can_send() {
            STATE.dropped.fetch_add(1, Ordering::Relaxed);
            return;
        }
        let position = POSE.get().and_then(|here| Position::from_mm(here.position_mm));
        let frame = SwarmFrame { robot: robot_id, position, message };
        if let Some(data) = frame.write(&mut [0; P2P_MAX]) {
            send(&SyslinkPacket::P2pSend { port: SWARM_PORT, data });
        }
    })
    .await
}
