//! The robot functions of the Crazyflie in the simulator.

use bittybuzz_arena::engine::Side;
use bittybuzz_arena::robot::{Done, Effect, RobotCall, led};
use bittybuzz_flight::pilot::PilotFunction;
use bittybuzz_robot_spec::RobotFunction;

use crate::pilot::CrazyflieAutopilot;

/// The value of `get_*` when nothing is in range. The world has no ceiling.
const OUT_OF_RANGE_MM: i32 = 32_767;

/// Returns the effect of a function that only the Crazyflie has; `None` for all others.
pub fn effect(function: &RobotFunction) -> Option<Effect> {
    if let Some(flight) = PilotFunction::named(&function.name) {
        return Some(Box::new(move |call| CrazyflieAutopilot::fly(call, flight)));
    }
    let range = |side: Side| -> Effect {
        Box::new(move |call| distance(call.io.sensors.range(side).map(|mm| mm as i32)))
    };
    Some(match function.name.as_str() {
        "led" => Box::new(set_led),
        "set_motor" => Box::new(|call| match (call.numbers.int(0), call.numbers.int(1)) {
            (0..=3, 0..=255) => Done::Nil,
            _ => Done::OutOfRange,
        }),
        "get_up" => Box::new(|_| distance(None)),
        "get_left" => range(Side::Left),
        "get_right" => range(Side::Right),
        "get_front" => range(Side::Front),
        "get_back" => range(Side::Back),
        "get_z" => Box::new(|call| distance(call.io.sensors.estimate().map(|here| here.z as i32))),
        "battery" => Box::new(|call| {
            let set = call.memory.battery_mv;
            Done::Int(set.unwrap_or_else(|| autopilot(call).battery_mv()).into())
        }),
        "rand_bbz" => Box::new(|call| Done::Int(call.memory.chance.below(300) as i32 - 150)),
        "show" => Box::new(|call| {
            let now_ms = call.io.milliseconds();
            let time = autopilot(call).stopwatch(now_ms);
            call.log(time);
            Done::Nil
        }),
        "start" => Box::new(|call| start(call, false)),
        "go" => Box::new(|call| start(call, true)),
        _ => return None,
    })
}

/// Returns the autopilot of the robot that calls.
fn autopilot<'a>(call: &'a mut RobotCall<'_, '_>) -> &'a mut CrazyflieAutopilot {
    call.autopilot().expect("a Crazyflie's functions run with its pilot")
}

/// Sets a LED for `led(c, on)`: the red one if c is 0, otherwise the green one.
fn set_led(call: &mut RobotCall<'_, '_>) -> Done {
    let numbers = call.numbers;
    if numbers.count() != 2 {
        return led(call);
    }
    let bit = if numbers.int(0) == 0 { 1 } else { 2 };
    let led = &mut *call.io.led;
    *led = if numbers.int(1) == 0 { *led & !bit } else { *led | bit };
    Done::Nil
}

fn start(call: &mut RobotCall<'_, '_>, restarts: bool) -> Done {
    let now_ms = call.io.milliseconds();
    autopilot(call).start_stopwatch(now_ms, restarts);
    Done::Nil
}

/// Returns a distance in mm as the robot's functions do: `OUT_OF_RANGE_MM` for `None`.
fn distance(mm: Option<i32>) -> Done {
    Done::Int(mm.unwrap_or(OUT_OF_RANGE_MM))
}
