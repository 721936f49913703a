//! The commands of a person at a ground station: port 9 of CRTP, channel 1 (crazyflie-firmware,
//! crtp_supervisor.h; cflib, supervisor.py).
//!
//! | command | byte after it | answer |
//! |---|---|---|
//! | 1, arm | 1 to arm, 0 to disarm | 0x81, success, 1 if the robot is armed |
//! | 3, emergency stop | | none |
//!
//! To arm is to permit: the motors start when the script takes off.

use core::sync::atomic::Ordering;

use bittybuzz_board::log;
use bittybuzz_comms::syslink::SyslinkPacket;

use super::send::send;
use crate::flight::pilot_desk::{DISARM, EMERGENCY_STOP};
use crate::pilot::{self, PersonRequest};
use crate::readiness;

/// Port 9, channel 1, and the mask of the reserved bits between them.
const COMMANDS: u8 = 0x91;
const HEADER_MASK: u8 = 0xf3;
const ARM: u8 = 1;
const EMERGENCY: u8 = 3;
/// The bit of an answer.
const ANSWER: u8 = 0x80;

/// Handles a packet of the ground station, if it is one of these commands.
pub fn process(packet: &[u8]) {
    let Some((header, data)) = packet.split_first() else { return };
    if header & HEADER_MASK != COMMANDS {
        return;
    }
    match data {
        [ARM, 0] => {
            DISARM.store(true, Ordering::Relaxed);
            pilot::REQUEST.signal(PersonRequest::Disarm);
            answer(*header, true, false);
        }
        [ARM, _] => {
            let refusal = readiness::refusal();
            if let Some(refusal) = refusal {
                log::warning!("the robot does not arm: {}", refusal);
            }
            let is_possible = refusal.is_none() && pilot::is_on_duty();
            if is_possible {
                pilot::REQUEST.signal(PersonRequest::Arm);
            }
            answer(*header, is_possible, is_possible);
        }
        [EMERGENCY, ..] => {
            EMERGENCY_STOP.store(true, Ordering::Relaxed);
            pilot::REQUEST.signal(PersonRequest::Disarm);
        }
        _ => {}
    }
}

fn answer(header: u8, success: bool, is_armed: bool) {
    let packet = [header, ARM | ANSWER, success.into(), is_armed.into()];
    send(&SyslinkPacket::Raw(&packet));
}
