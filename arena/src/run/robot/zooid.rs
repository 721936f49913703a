//! Functions of the Zooid.

use bittybuzz_vm_core::link::name_hash;

use crate::engine::{Pose, Wheels, wrap};

use super::call::{Done, Numbers};

/// mm at which a Zooid has arrived: the goal radius of its makers' manager.
const ARRIVED: f32 = 6.5;

pub fn call(wheels: &mut Wheels, here: Option<Pose>, hash: u16, numbers: &Numbers) -> Done {
    const SET_MOTOR: u16 = name_hash("set_motor");
    const FORWARD: u16 = name_hash("forward");
    const LEFT: u16 = name_hash("left");
    const RIGHT: u16 = name_hash("right");
    const GOTO: u16 = name_hash("goto");
    const GREY_CODE: u16 = name_hash("greyCode");

    *wheels = match hash {
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
        GOTO => return goto(wheels, here, [numbers.float(0), numbers.float(1)]),
        GREY_CODE => return Done::Int(numbers.int(0) ^ (numbers.int(0) >> 1)),
        _ => return Done::Unknown,
    };
    Done::Nil
}

/// Turns towards the goal, then drives there, the slower the closer it is.
fn goto(wheels: &mut Wheels, here: Option<Pose>, [x, y]: [f32; 2]) -> Done {
    let Some(here) = here else {
        *wheels = Wheels::default();
        return Done::Int(0);
    };
    let (dx, dy) = (x - here.x, y - here.y);
    let distance = libm::hypotf(dx, dy);
    if distance < ARRIVED {
        *wheels = Wheels::default();
        return Done::Int(1);
    }
    let angle = wrap(libm::atan2f(dy, dx) - here.heading);
    // A tick lasts 100 ms: faster than this it would run past the goal, or turn beyond it.
    let turn = (angle * 4.0).clamp(-9.0, 9.0);
    let ahead = if angle.abs() < 0.5 { (distance * 0.12).min(24.0) } else { 0.0 };
    let duty = |effort: f32| match effort {
        _ if effort.abs() < 0.3 => 0,
        // Up to a duty of 22 a wheel stands still.
        _ => (effort.abs().max(1.0) + 22.0).min(60.0).copysign(effort).round() as i8,
    };
    *wheels = Wheels { left: duty(ahead - turn), right: duty(ahead + turn) };
    Done::Wait
}
