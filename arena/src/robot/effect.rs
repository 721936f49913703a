//! Effects of functions that have the same meaning on every robot.

use bittybuzz_robot_spec::RobotFunction;

use super::call::{Done, Effect, RobotCall};

/// Returns the effect of a function that is the same on every robot: `led`, `light`, `print`.
#[must_use]
pub fn common(function: &RobotFunction) -> Option<Effect> {
    Some(match function.name.as_str() {
        "led" => Box::new(led),
        "light" => Box::new(light),
        "print" => Box::new(print),
        _ => return None,
    })
}

/// `led(color)`: the sum of 1 red, 2 green, 4 blue; `led(red, green, blue)`: the brightness of each.
pub fn led(call: &mut RobotCall<'_, '_>) -> Done {
    let numbers = call.numbers;
    *call.io.led = match numbers.count() {
        1 => (numbers.int(0) & 7) as u8,
        3 => (0..3).filter(|index| numbers.int(*index) > 0).map(|index| 1 << index).sum(),
        _ => return Done::Idle,
    };
    Done::Nil
}

fn light(call: &mut RobotCall<'_, '_>) -> Done {
    Done::Int(call.io.sensors.light().into())
}

fn print(call: &mut RobotCall<'_, '_>) -> Done {
    call.log(Vec::new());
    Done::Nil
}
