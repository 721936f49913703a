//! Functions of the Kilobot.

use bittybuzz_vm_core::hash::name_hash;

use crate::robots::kilobot::KilobotMotors;

use super::call::{Done, Numbers};

/// What a charged battery reads: as in Kilombo.
const CHARGED: i32 = 876;

/// Duties that calibration has found: straight on, and for a turn.
#[derive(Debug, Clone, Copy, Default)]
pub struct Duties {
    pub straight: u8,
    pub turn: u8,
}

pub fn call(motors: &mut KilobotMotors, duties: Duties, hash: u16, numbers: &Numbers) -> Done {
    const SET_MOTOR: u16 = name_hash("set_motor");
    const FORWARD: u16 = name_hash("forward");
    const LEFT: u16 = name_hash("left");
    const RIGHT: u16 = name_hash("right");
    const STOP: u16 = name_hash("stop");
    const BATTERY: u16 = name_hash("battery");

    *motors = match hash {
        SET_MOTOR => {
            let duty = |index| u8::try_from(numbers.int(index));
            let (Ok(left), Ok(right)) = (duty(0), duty(1)) else { return Done::OutOfRange };
            KilobotMotors { left, right }
        }
        FORWARD => KilobotMotors { left: duties.straight, right: duties.straight },
        LEFT => KilobotMotors { left: duties.turn, right: 0 },
        RIGHT => KilobotMotors { left: 0, right: duties.turn },
        STOP => KilobotMotors { left: 0, right: 0 },
        BATTERY => return Done::Int(CHARGED),
        _ => return Done::Unknown,
    };
    Done::Nil
}
