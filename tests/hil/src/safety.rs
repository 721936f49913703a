//! Resets of a Crazyflie, and the states in which it may be after one: its script runs, or nothing but its radio.

use std::time::Duration;

use bittybuzz_emulation::message::ResetCause;

use crate::{Command, EmulatorEvent, Robot, TimedEvent, is_lit, motors};

/// Resets the robot, and returns when.
pub fn reset(robot: &mut Robot, cause: ResetCause) -> Duration {
    let at = robot.now();
    robot.execute(&Command::Reset { cause });
    robot.run_us(1);
    at
}

/// The events since `from`.
pub fn since(robot: &Robot, from: Duration) -> &[TimedEvent] {
    let first = robot.events.partition_point(|event| event.at < from);
    &robot.events[first..]
}

/// Returns true if Bitcraze's bootloader has started another program than the firmware since the reset at `reset`.
pub fn is_in_loader(robot: &Robot, reset: Duration) -> bool {
    since(robot, reset).iter().any(|event| matches!(event.event, EmulatorEvent::Loader { .. }))
}

/// No motor has turned since the reset at `reset`.
pub fn assert_motors_off(robot: &Robot, reset: Duration) {
    for event in since(robot, reset) {
        if let EmulatorEvent::Motor { duty, .. } = event.event {
            assert_eq!(duty, 0.0, "after the reset at {reset:?}: {event:?}");
        }
    }
    assert_eq!(motors(&robot.events), [0.0; 4]);
}

/// The firmware runs, but no script: red, and a radio that answers.
pub fn assert_locked(robot: &mut Robot, reset: Duration) {
    robot.run_ms(700);
    assert_motors_off(robot, reset);
    let after = since(robot, reset);
    assert!(is_lit(after, "red_right"), "{after:?}");
    for led in ["red_left", "green_left", "blue_left"] {
        assert!(!is_lit(after, led), "{led}: the script runs");
    }
    assert!(robot.ping(1, 10).is_some(), "the radio is dead");
}

/// The script runs: within a second of now all motors turn.
pub fn assert_runs(robot: &mut Robot) {
    let now = robot.now();
    robot.run_ms(1000);
    let duties = motors(&robot.events);
    assert!(duties.iter().all(|duty| *duty > 0.05), "{duties:?}");
    assert!(!is_lit(since(robot, now), "red_right"));
}
