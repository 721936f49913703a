//! Functions of the Zooid.

use bittybuzz_vm_core::hash::name_hash;

use bittybuzz_motion::drive::{Goal, Wheels};
use bittybuzz_motion::units;

use crate::engine::Pose;
use crate::robots::zooid::{Drive, for_firmware};

use super::call::{Done, Numbers};

pub fn call(
    drive: &mut Drive,
    here: Option<Pose>,
    battery: Option<u16>,
    hash: u16,
    numbers: &Numbers,
) -> Done {
    const SET_MOTOR: u16 = name_hash("set_motor");
    const FORWARD: u16 = name_hash("forward");
    const LEFT: u16 = name_hash("left");
    const RIGHT: u16 = name_hash("right");
    const STOP: u16 = name_hash("stop");
    const GOTO: u16 = name_hash("goto");
    const BATTERY: u16 = name_hash("battery");
    const TOUCHED: u16 = name_hash("touched");
    const GREY_CODE: u16 = name_hash("greyCode");

    let wheels = match hash {
        SET_MOTOR => {
            let duty = |index| i8::try_from(numbers.int(index)).ok();
            let within = |duty: &i8| (-100..=100).contains(duty);
            let (Some(left), Some(right)) = (duty(0).filter(within), duty(1).filter(within)) else {
                return Done::OutOfRange;
            };
            Wheels { left, right }
        }
        FORWARD => Wheels { left: 80, right: 80 },
        LEFT => Wheels { left: -40, right: 40 },
        RIGHT => Wheels { left: 40, right: -40 },
        STOP => Wheels::default(),
        GOTO => {
            let [x, y] = [0, 1].map(|index| units::from_mm(numbers.float(index)));
            let (Some(x), Some(y)) = (x, y) else { return Done::OutOfRange };
            let goal = Goal { x, y };
            *drive = Drive::Goal(goal);
            let is_there = here.is_some_and(|here| goal.is_reached(&for_firmware(&here)));
            return Done::Int(is_there.into());
        }
        BATTERY => return Done::Int(battery.unwrap_or(BATTERY_MV).into()),
        // Nobody is there who could.
        TOUCHED => return Done::Int(0),
        GREY_CODE => return Done::Int(numbers.int(0) ^ (numbers.int(0) >> 1)),
        _ => return Done::Unknown,
    };
    *drive = Drive::Wheels(wheels);
    Done::Nil
}

/// Half full, and it stays so unless the scenario says otherwise.
const BATTERY_MV: u16 = 3800;
