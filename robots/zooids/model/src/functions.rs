//! The robot functions of the Zooid in the simulator.

use bittybuzz_arena::robot::{Done, Effect, RobotCall};
use bittybuzz_motion::drive::{Goal, Wheels};
use bittybuzz_motion::units;
use bittybuzz_robot_spec::RobotFunction;

use crate::Drive;
use crate::body::for_firmware;

/// Voltage of a half full battery in mV; it is constant unless the scenario sets it.
const BATTERY_MV: u16 = 3800;

/// Returns the effect of a function that only the Zooid has; `None` for all others.
pub fn effect(function: &RobotFunction) -> Option<Effect> {
    let wheels = |left: i8, right: i8| -> Effect {
        Box::new(move |call| drive(call, Drive::Wheels(Wheels { left, right })))
    };
    Some(match function.name.as_str() {
        "set_motor" => Box::new(set_motor),
        "forward" => wheels(80, 80),
        "left" => wheels(-40, 40),
        "right" => wheels(40, -40),
        "stop" => wheels(0, 0),
        "goto" => Box::new(go_to),
        "battery" => {
            Box::new(|call| Done::Int(call.memory.battery_mv.unwrap_or(BATTERY_MV).into()))
        }
        // The simulated world has no hands that could touch the robot.
        "touched" => Box::new(|_| Done::Int(0)),
        "greyCode" => Box::new(|call| {
            let number = call.numbers.int(0);
            Done::Int(number ^ (number >> 1))
        }),
        _ => return None,
    })
}

fn drive(call: &mut RobotCall<'_, '_>, command: Drive) -> Done {
    *call.io.controls().expect("a Zooid's functions move a Zooid's body") = command;
    Done::Nil
}

fn set_motor(call: &mut RobotCall<'_, '_>) -> Done {
    let duty = |index| i8::try_from(call.numbers.int(index)).ok();
    let within = |duty: &i8| (-100..=100).contains(duty);
    let (Some(left), Some(right)) = (duty(0).filter(within), duty(1).filter(within)) else {
        return Done::OutOfRange;
    };
    drive(call, Drive::Wheels(Wheels { left, right }))
}

fn go_to(call: &mut RobotCall<'_, '_>) -> Done {
    let [x, y] = [0, 1].map(|index| units::from_mm(call.numbers.float(index)));
    let (Some(x), Some(y)) = (x, y) else { return Done::OutOfRange };
    let goal = Goal { x, y };
    drive(call, Drive::Goal(goal));
    let here = call.io.sensors.estimate();
    let is_there = here.is_some_and(|here| goal.is_reached(&for_firmware(&here)));
    Done::Int(is_there.into())
}
