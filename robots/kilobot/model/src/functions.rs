//! The robot functions of the Kilobot in the simulator.

use bittybuzz_arena::robot::{Done, Effect, RobotCall};
use bittybuzz_robot_spec::RobotFunction;

use crate::{KilobotModel, KilobotMotors};

/// The converter's reading for a charged battery, as in Kilombo.
const CHARGED: i32 = 876;

/// Returns the effect of a function that only the Kilobot has; `None` for all others.
pub fn effect(model: &KilobotModel, function: &RobotFunction) -> Option<Effect> {
    let motors = |left: u8, right: u8| -> Effect {
        Box::new(move |call| set_motors(call, KilobotMotors { left, right }))
    };
    let (straight, turn) = (model.straight_duty, model.turn_duty);
    Some(match function.name.as_str() {
        "set_motor" => Box::new(set_motor),
        "forward" => motors(straight, straight),
        "left" => motors(turn, 0),
        "right" => motors(0, turn),
        "stop" => motors(0, 0),
        "battery" => Box::new(|_| Done::Int(CHARGED)),
        _ => return None,
    })
}

fn set_motor(call: &mut RobotCall<'_, '_>) -> Done {
    let duty = |index| u8::try_from(call.numbers.int(index));
    let (Ok(left), Ok(right)) = (duty(0), duty(1)) else { return Done::OutOfRange };
    set_motors(call, KilobotMotors { left, right })
}

fn set_motors(call: &mut RobotCall<'_, '_>, command: KilobotMotors) -> Done {
    *call.io.controls().expect("a Kilobot's functions move a Kilobot's body") = command;
    Done::Nil
}
