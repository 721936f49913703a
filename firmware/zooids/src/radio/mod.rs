//! Swarm messages by radio, which are broadcasts without acknowledgement.

pub mod nrf24;

use bittybuzz_comms::nrf24::{PAYLOAD_MAX, Payload};
use bittybuzz_comms::queue::is_followed;
use bittybuzz_motion::{Length, MM, units};
use bittybuzz_runtime::liveness::{BEAT, Pulse};
use bittybuzz_runtime::mail::{Mail, pause};
use bittybuzz_vm_core::number::{Rng, Tiny};
use bittybuzz_vm_core::{Sighting, Value};
use embassy_futures::select::{Either3, select3};
use embassy_time::{Duration, Instant, Timer};

use crate::robot::{FRAME_BYTES, IN_LONG, IN_QUEUE, OUT_LONG, OUT_QUEUE};
use crate::settings::{chip, setting};
use crate::{eyes, robot, sensors};
use bittybuzz_board::log;
use nrf24::{IRQ, Nrf24};

/// The messages that wait for the script, and those that wait for the radio.
pub static MAIL: Mail<Tiny, FRAME_BYTES, IN_QUEUE, OUT_QUEUE, IN_LONG, OUT_LONG> = Mail::new();

/// The counts of payloads since the start: received ones, received ones that are no swarm messages,
/// and sent ones.
#[cfg(feature = "defmt")]
pub static COUNTS: [portable_atomic::AtomicU32; 3] =
    [const { portable_atomic::AtomicU32::new(0) }; 3];

/// The index of a counter in `COUNTS`, which only exists with defmt.
#[derive(Clone, Copy)]
enum Count {
    Heard,
    Unknown,
    Sent,
}

/// Increments a counter. Without defmt the counters have no reader and do not exist.
fn count(_what: Count) {
    #[cfg(feature = "defmt")]
    COUNTS[_what as usize].add(1, portable_atomic::Ordering::Relaxed);
}

/// The factor by which the first message of several waits longer than the others. A robot cannot
/// detect transmissions that began within the 0.3 ms before its own.
const FIRST: u32 = 3;

/// The number of busy channel checks after which a frame is sent anyway, as many as IEEE 802.15.4
/// allows (macMaxCSMABackoffs). Neither a jammed channel nor a detector that never clears may
/// silence a robot.
const BUSY_CHECKS_MAX: u8 = 4;

/// The time in which the next fragment of a message arrives, unless the channel is busy: the longest
/// pause of its sender.
const FOLLOWING: Duration = Duration::from_millis(18);

/// The most times in a row that a robot lets others finish their messages: twice the fragments of the
/// longest one. It gets one more with each frame that it sends, so that robots which begin messages
/// and do not finish them delay each frame once, on the average.
const DEFERRALS_MAX: u8 = 16;

/// The receiver of swarm messages.
struct SwarmReceiver {
    robot_id: u16,
    /// Messages from robots beyond this distance are discarded.
    range: Option<Length>,
    /// True once the log reported that another robot has this one's id.
    has_reported: bool,
}

impl SwarmReceiver {
    /// Handles a received payload. The sender's location is computed now, because both robots may
    /// have moved by the next step. Returns true if other fragments of the same message follow.
    fn process(&mut self, payload: &[u8]) -> bool {
        count(Count::Heard);
        let Some(Payload { robot, position, message }) = Payload::parse(payload) else {
            count(Count::Unknown);
            return false;
        };
        if robot == self.robot_id && !self.has_reported {
            self.has_reported = true;
            log::warning!("another robot has id {=u16}, too: `bbz flash --id`", robot);
        }
        let mut place = None;
        if let Some(there) = position
            && let Some(here) = eyes::pose()
        {
            let [x, y] = there.map(|mm| i32::from(mm) * MM);
            let (distance, azimuth) = here.sight(x, y);
            if self.range.is_some_and(|range| distance > range) {
                return false;
            }
            place = Some([units::mm(distance), units::radians(azimuth), 0.0].map(Value::float));
        }
        MAIL.add_received(message, Sighting { robot: Some(robot), place });
        message.first().is_some_and(|first| is_followed(*first))
    }
}

/// Runs the task of the radio, which receives except while it sends.
#[embassy_executor::task]
pub async fn talk(mut radio: Nrf24, robot_id: u16, pulse: Pulse) -> ! {
    let range = setting(robot::setting::RANGE_MM).map(|mm| i32::from(mm) * MM);
    let mut receiver = SwarmReceiver { robot_id, range, has_reported: false };
    // The chip's hash is part of the seed. Robots that have the same id by mistake therefore send
    // at different times, and can detect each other.
    let mut rng = Rng::new(chip(), robot_id);
    let mut payload = [0; PAYLOAD_MAX];
    // The time of the next attempt to send.
    let mut turn: Option<Instant> = None;
    let (mut busy_checks, mut deferrals) = (0, 0_u8);
    pulse.beat();
    radio.start().await;
    loop {
        pulse.beat();
        if sensors::radio_rests() {
            radio.sleep();
            while sensors::radio_rests() {
                pulse.beat();
                Timer::after(BEAT).await;
            }
            radio.start().await;
        }
        let next_turn = async {
            match turn {
                Some(at) => Timer::at(at).await,
                None => MAIL.wait().await,
            }
        };
        match select3(IRQ.wait(), next_turn, Timer::after(BEAT)).await {
            Either3::Second(()) => {
                let now = Instant::now();
                if turn.is_none() {
                    // The first message waits, because all robots may step at the same time.
                    turn = Some(now + pause(&mut rng) * FIRST);
                    continue;
                }
                turn = Some(now + pause(&mut rng));
                if busy_checks < BUSY_CHECKS_MAX && radio.is_busy().await {
                    busy_checks += 1;
                    continue;
                }
                busy_checks = 0;
                match fill(&mut payload, robot_id) {
                    Some(length) => {
                        deferrals = deferrals.saturating_sub(1);
                        if let Some(payload) = payload.get_mut(..length) {
                            radio.send(payload).await;
                            count(Count::Sent);
                        }
                    }
                    None => turn = None,
                }
            }
            // Payloads are read without an interrupt, too, since one may have arrived while the
            // radio was sending.
            Either3::First(()) | Either3::Third(()) => {}
        }
        radio.acknowledge();
        while let Some(length) = radio.receive(&mut payload) {
            let is_followed = receiver.process(payload.get(..length).unwrap_or(&[]));
            if let (Some(at), true) = (&mut turn, is_followed)
                && deferrals != DEFERRALS_MAX
                && !MAIL.is_within_message()
            {
                // Receivers have places for few messages at the same time.
                *at = (*at).max(Instant::now() + FOLLOWING + pause(&mut rng));
                deferrals += 1;
            }
        }
    }
}

/// Writes the script's next message and the robot's present position as a payload, and returns the
/// length.
fn fill(payload: &mut [u8; PAYLOAD_MAX], robot: u16) -> Option<usize> {
    let mut frame = [0; FRAME_BYTES];
    let length = MAIL.next_unsent(&mut frame)?;
    let position = eyes::pose().map(|pose| [pose.x, pose.y].map(nearest_mm));
    Payload { robot, position, message: frame.get(..length)? }.write(payload)
}

/// Rounds to whole mm. Under the projector no coordinate is beyond 1 m, so the result fits 16 bits.
fn nearest_mm(length: i32) -> i16 {
    (length + MM / 2).div_euclid(MM) as i16
}
