//! Swarm messages by radio: broadcasts that nobody acknowledges.

pub mod nrf24;

use core::cell::Cell;

use bittybuzz_comms::nrf24::{PAYLOAD_MAX, Payload};
use bittybuzz_motion::{MM, units};
use bittybuzz_runtime::liveness::{BEAT, Pulse};
use bittybuzz_runtime::mail::{Mail, pause};
use bittybuzz_vm_core::number::{Rng, Tiny};
use bittybuzz_vm_core::{Sighting, Value};
use embassy_futures::select::{Either3, select3};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_time::{Instant, Timer};

use crate::robot::{FRAME_BYTES, IN_QUEUE, OUT_QUEUE};
use crate::{eyes, id, log, sensors};
use nrf24::{IRQ, Nrf24};

/// Messages that wait for the script, and those that wait for the radio.
pub static MAIL: Mail<Tiny, FRAME_BYTES, IN_QUEUE, OUT_QUEUE> = Mail::new();

/// What has come, and what of it is none.
static COUNTS: Mutex<CriticalSectionRawMutex, Cell<Counts>> =
    Mutex::new(Cell::new(Counts { heard: 0, unknown: 0, sent: 0 }));

/// Payloads since the start.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Counts {
    /// That came.
    heard: u32,
    /// Of these, the ones that are no swarm messages.
    unknown: u32,
    /// That were sent.
    sent: u32,
}

fn count(act: impl FnOnce(&mut Counts)) {
    COUNTS.lock(|cell| {
        let mut counts = cell.get();
        act(&mut counts);
        cell.set(counts);
    });
}

/// What was counted.
#[cfg(feature = "defmt")]
pub fn counts() -> Counts {
    COUNTS.lock(Cell::get)
}

/// What hears swarm messages.
struct Ears {
    robot_id: u16,
    /// Whether it was told that another robot has this one's id.
    has_told: bool,
}

impl Ears {
    /// Where a message's sender is seen now is found out now: at the next step both robots may be elsewhere.
    fn hear(&mut self, payload: &[u8]) {
        count(|counts| counts.heard += 1);
        let Some(Payload { robot, position, message }) = Payload::parse(payload) else {
            count(|counts| counts.unknown += 1);
            return;
        };
        if robot == self.robot_id && !self.has_told {
            self.has_told = true;
            log::warning!("another robot has id {=u16}, too: `bbz flash --id`", robot);
        }
        let place = match (eyes::pose(), position) {
            (Some(here), Some(there)) => {
                let [x, y] = there.map(|mm| i32::from(mm) * MM);
                let (distance, azimuth) = here.sight(x, y);
                Some([units::mm(distance), units::radians(azimuth), 0.0].map(Value::float))
            }
            _ => None,
        };
        MAIL.hear(message, Sighting { robot: Some(robot), place });
    }
}

/// The task. It listens, but for the time that sending takes.
#[embassy_executor::task]
pub async fn talk(mut radio: Nrf24, robot_id: u16, pulse: Pulse) -> ! {
    let mut ears = Ears { robot_id, has_told: false };
    // Also robots that have the same id by mistake send at different times, and so hear of it.
    let mut rng = Rng::new(id::chip(), robot_id);
    let mut payload = [0; PAYLOAD_MAX];
    // When to try to send.
    let mut turn: Option<Instant> = None;
    pulse.beat();
    radio.start().await;
    loop {
        pulse.beat();
        if sensors::is_charging() {
            radio.sleep();
            while sensors::is_charging() {
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
                // Not at once: all robots may step at the same time.
                let is_due = turn.replace(Instant::now() + pause(&mut rng)).is_some();
                if !is_due || radio.is_busy() {
                    continue;
                }
                match fill(&mut payload, robot_id) {
                    Some(length) => {
                        if let Some(payload) = payload.get_mut(..length) {
                            radio.send(payload).await;
                            count(|counts| counts.sent += 1);
                        }
                    }
                    None => turn = None,
                }
            }
            // Also without an interrupt: one that came while the radio was sending.
            Either3::First(()) | Either3::Third(()) => {}
        }
        while let Some(length) = radio.receive(&mut payload) {
            ears.hear(payload.get(..length).unwrap_or(&[]));
        }
    }
}

/// Writes the script's next message as a payload, with where the robot is now.
fn fill(payload: &mut [u8; PAYLOAD_MAX], robot: u16) -> Option<usize> {
    let mut frame = [0; FRAME_BYTES];
    let length = MAIL.next_unsent(&mut frame)?;
    let position = eyes::pose().map(|pose| [pose.x, pose.y].map(|along| nearest_mm(along)));
    Payload { robot, position, message: frame.get(..length)? }.write(payload)
}

/// Under the projector no coordinate is beyond 1 m.
fn nearest_mm(length: i32) -> i16 {
    ((length + MM / 2) / MM) as i16
}
