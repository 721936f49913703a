//! A ground station flies the firmware's image in the physics, by packets that cflib 0.1.34 sent for these
//! calls (comms/crtp/tests/vectors).

use std::time::Duration;

use bittybuzz_hil::{
    Command, Core, EmulatorEvent, RADIO_RAW, Robot, TraceLog, frames, motors, resets, standing,
};
use serde_json::Value;

use crate::flight::last_motion;

/// `supervisor.send_arming_request(True)`, and its answer: accepted, armed.
const ARM: [u8; 3] = [0x9d, 1, 1];
const ARMED: [u8; 4] = [0x9d, 0x81, 1, 1];
/// `high_level_commander.takeoff(0.5, 2.0, 0, 0.0)`.
const TAKE_OFF: [u8; 16] = [
    0x8c, 0x07, 0x00, 0x00, 0x00, 0x00, 0x3f, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x40,
];
/// `commander.send_position_setpoint(1.0, -2.0, 0.5, 180.0)`.
const POSITION: [u8; 18] =
    [0x7c, 7, 0, 0, 0x80, 0x3f, 0, 0, 0, 0xc0, 0, 0, 0, 0x3f, 0, 0, 0x34, 0x43];
/// `commander.send_notify_setpoint_stop(500)`.
const SETPOINTS_END: [u8; 6] = [0x7d, 0, 0xf4, 1, 0, 0];
/// `high_level_commander.land(0.0, 2.0, 0, 1.5)`.
const LAND: [u8; 16] = [
    0x8c, 0x08, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0xc0, 0x3f, 0x00, 0x00, 0x00, 0x00, 0x40,
];

/// Flights of cflib's MotionCommander, each with its height in m, the speed of its landing in m/s,
/// and the times in ms and the digits of its packets.
const MOTION_COMMANDER: &str =
    include_str!("../../../firmware/station/tests/vectors/motion_commander.jsonl");
/// A script that does nothing.
const IDLE: &str = "function init() {}\nfunction step() {}\n";

fn place_m(robot: &Robot) -> [f64; 3] {
    let place = robot.events.iter().rev().find_map(|event| match event.event {
        EmulatorEvent::Motion { position_m, .. } => Some(position_m),
        _ => None,
    });
    place.expect("the body reports its motion")
}

fn distance_m(robot: &Robot, to_m: [f64; 3]) -> f64 {
    let squares = place_m(robot).into_iter().zip(to_m).map(|(a, b)| (a - b).powi(2));
    squares.sum::<f64>().sqrt()
}

/// Returns a robot that the station armed.
fn armed(seed: u64) -> Robot {
    let mut robot = standing(IDLE, seed);
    robot.send(RADIO_RAW, &ARM);
    robot.run_ms(50);
    assert!(frames(&robot.events, RADIO_RAW).any(|(_, packet)| packet == ARMED), "not armed");
    robot
}

/// Poses come from a motion capture, which is a station too, so the plans stay in force.
#[test]
fn a_station_flies_the_image() {
    let mut robot = armed(1);
    robot.send(RADIO_RAW, &TAKE_OFF);
    robot.run_ms(4_000);
    assert!((place_m(&robot)[2] - 0.5).abs() < 0.02, "{:?}", place_m(&robot));
    for _ in 0..80 {
        robot.send(RADIO_RAW, &POSITION);
        robot.run_ms(100);
    }
    assert!(distance_m(&robot, [1.0, -2.0, 0.5]) < 0.05, "{:?}", place_m(&robot));
    robot.send(RADIO_RAW, &SETPOINTS_END);
    robot.run_ms(500);
    robot.send(RADIO_RAW, &LAND);
    robot.run_ms(6_000);
    assert_eq!(motors(&robot.events), [0.0; 4]);
    assert!(distance_m(&robot, [1.0, -2.0, 0.0]) < 0.1, "{:?}", place_m(&robot));
    assert_eq!(resets(&robot.events), []);
}

/// The commander stops the motors when its height has reached the ground, and the robot is late. The
/// tests of firmware/station replay all flights.
fn the_motion_commander_lands(seed: u64, line: usize) {
    let line = MOTION_COMMANDER.lines().nth(line).unwrap();
    let flight: Value = serde_json::from_str(line).unwrap();
    let name = format!("{} m, {} m/s", flight[0], flight[1]);
    let mut robot = armed(seed);
    let begin = robot.now();
    for packet in flight[2].as_array().unwrap() {
        let at = begin + Duration::from_millis(packet[0].as_u64().unwrap());
        robot.run_us(at.saturating_sub(robot.now()).as_micros() as u64);
        robot.send(RADIO_RAW, &bytes(packet[1].as_str().unwrap()));
    }
    let late_m = last_motion(&robot).position_m[2];
    assert!((0.08..0.8).contains(&late_m), "{name}: {late_m} m");
    robot.run_ms(6_000);
    let end = last_motion(&robot);
    assert!(!end.has_crashed && end.position_m[2] < 0.03, "{name}: {:?}", end.position_m);
    assert_eq!(motors(&robot.events), [0.0; 4], "{name}");
    assert_eq!(resets(&robot.events), [], "{name}");
}

/// From 1 m at 1 m/s, the highest and fastest.
#[test]
fn the_motion_commander_lands_the_image() {
    the_motion_commander_lands(4, 5);
}

#[test]
#[ignore = "soak"]
fn the_motion_commander_lands_from_other_heights() {
    the_motion_commander_lands(2, 1);
    the_motion_commander_lands(3, 3);
}

/// Returns the bytes of hexadecimal digits.
fn bytes(digits: &str) -> Vec<u8> {
    let pairs = digits.as_bytes().chunks(2);
    pairs.map(|pair| u8::from_str_radix(str::from_utf8(pair).unwrap(), 16).unwrap()).collect()
}

/// `extpos.send_extpos(1.5, -0.25, 0.015)` each 20 ms, on a robot that stands there and was switched on with
/// another place in mind. cflib sends `extpos.send_extpos(-1.5, 0.25, 2.0)` as 6c0000c0bf0000803e00000040.
#[test]
fn positions_without_attitude_are_places_for_the_script() {
    let place_m: [f32; 3] = [1.5, -0.25, 0.015];
    let mut robot =
        Robot::crazyflie(Core::Unicorn, "function step() { log(pos.x, pos.y, pos.z) }\n");
    robot.execute(&Command::Body {
        seed: 1,
        x_mm: 1500.0,
        y_mm: -250.0,
        yaw_degrees: 0.0,
        pose_ms: 0,
        pose_noise_mm: 0.0,
        pose_noise_degrees: 0.0,
    });
    robot.run_ms(2_000);
    let places = |robot: &Robot| -> Vec<[f32; 3]> {
        let log = TraceLog::of_events(&robot.events).log.into_iter();
        let known = log.filter(|(_, values)| values[0] != "nil");
        known.map(|(_, values)| [0, 1, 2].map(|axis| values[axis].parse().unwrap())).collect()
    };
    assert_eq!(places(&robot).len(), 0, "without a position");
    let packet = [&[0x6c][..], &place_m.map(f32::to_le_bytes).concat()].concat();
    for _ in 0..100 {
        robot.send(RADIO_RAW, &packet);
        robot.run_ms(20);
    }
    let known = places(&robot);
    assert!(known.len() > 8, "{} steps with a place", known.len());
    for place_mm in &known {
        let errors = place_mm.iter().zip(place_m).map(|(mm, m)| (mm - 1000.0 * m).abs());
        assert!(errors.fold(0.0, f32::max) < 20.0, "{place_mm:?}");
    }
    // A place is valid for a second.
    robot.run_ms(1_200);
    let count = places(&robot).len();
    robot.run_ms(1_000);
    assert_eq!(places(&robot).len(), count);
}
