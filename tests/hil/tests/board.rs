//! Boards that look like a Crazyflie's to the program but for their device type, in the chip's one-time programmable memory.

use std::time::Duration;

use bittybuzz_emulation::message::ResetCause;
use bittybuzz_hil::{Command, Core, EmulatorEvent, Robot, Swarm, is_lit, motors, resets};

/// All motors turn, and the script's LEDs shine.
const DRIVE: &str = "\
function step() {
  led(7)
  set_motor(0, 40) set_motor(1, 40) set_motor(2, 40) set_motor(3, 40)
}
";

/// Slots of the device type: each has 32 bytes, with zeros after the text.
fn slots(texts: &[&str]) -> Vec<u8> {
    let slot = |text: &&str| {
        let mut slot = text.as_bytes().to_vec();
        slot.resize(32, 0);
        slot
    };
    texts.iter().flat_map(slot).collect()
}

/// A robot after a second, whose chip holds this.
fn started(otp: Vec<u8>) -> Swarm {
    let mut swarm = Swarm::crazyflies(DRIVE, &[7]);
    let robot = &mut swarm.members()[0].robot;
    robot.execute(&Command::Otp { bytes: otp });
    robot.execute(&Command::Reset { cause: ResetCause::PowerOn });
    swarm.run_ms(1000);
    swarm
}

#[test]
fn boards_with_brushed_motors_run_the_script() {
    for otp in [
        slots(&["0;CF20"]),
        slots(&["0;CF21"]),
        slots(&["0;CF21;R=D"]),
        // Another device type was erased by zeros.
        slots(&["", "", "0;CF21"]),
        // The first ones had none.
        vec![],
        slots(&[""; 16]),
    ] {
        let mut swarm = started(otp.clone());
        let robot = &swarm.members()[0].robot;
        let duties = motors(&robot.events);
        assert!(duties.iter().all(|duty| *duty > 0.1), "{otp:?}: {duties:?}");
        assert!(is_lit(&robot.events, "green_left") && !is_lit(&robot.events, "red_right"));
    }
}

#[test]
fn boards_with_other_motors_are_refused_and_named() {
    for (otp, name) in [
        (slots(&["0;C21B"]), "a Crazyflie 2.1 Brushless (device type b\"C21B\")"),
        (slots(&["0;CB10"]), "a Crazyflie Bolt (device type b\"CB10\")"),
        (slots(&["0;RZ10"]), "a Crazyflie Bolt (device type b\"RZ10\")"),
        (slots(&["0;CB11;R=B"]), "a Crazyflie Bolt 1.1 (device type b\"CB11\")"),
        (slots(&["0;RR10"]), "a Roadrunner (device type b\"RR10\")"),
        (slots(&["", "0;C21B"]), "a Crazyflie 2.1 Brushless (device type b\"C21B\")"),
        (slots(&["0;CF22"]), "an unknown board (device type b\"CF22\")"),
        (slots(&["0;CF21B"]), "an unknown board (device type b\"CF21B\")"),
        // The form of the text is another one.
        (slots(&["1;CF21"]), "an unknown board (device type b\"1;CF21\")"),
        (vec![b'x'; 512], "an unknown board (device type b\"xxxxxxxx\")"),
    ] {
        let mut swarm = started(otp);
        let member = &mut swarm.members()[0];
        let lines = &member.trace_log.firmware;
        assert!(lines.iter().any(|line| line.contains(name)), "{name}: {lines:?}");
        let events = &member.robot.events;
        assert_eq!(motors(events), [0.0; 4], "{name}");
        let moved = |event: &EmulatorEvent| matches!(event, EmulatorEvent::Motor { .. });
        assert!(!events.iter().any(|event| moved(&event.event)), "{name}: a pin moved");
        assert!(is_lit(events, "red_right"), "{name}");
        for led in ["red_left", "green_left", "blue_left"] {
            assert!(!is_lit(events, led), "{name}: the script runs");
        }
        assert_eq!(resets(events).len(), 1, "{name}: all tasks live");
        assert!(member.robot.ping(1, 10).is_some_and(|span| span < Duration::from_millis(5)));
    }
}

#[test]
#[ignore = "soak"]
fn a_board_with_other_motors_is_refused_on_qemu() {
    for (device_type, is_refused) in [("0;C21B", true), ("0;CF20", false)] {
        let mut robot = Robot::crazyflie(Core::Qemu, DRIVE);
        robot.execute(&Command::Otp { bytes: slots(&[device_type]) });
        robot.execute(&Command::Reset { cause: ResetCause::PowerOn });
        robot.run_ms(250);
        let is_off = motors(&robot.events) == [0.0; 4];
        assert_eq!([is_off, is_lit(&robot.events, "red_right")], [is_refused; 2], "{device_type}");
    }
}
