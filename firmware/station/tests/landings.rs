//! Ends of flights by set-points that lead to the ground.

use bittybuzz_flight::Vec3;
use bittybuzz_flight::supervisor::SupervisorStage;
use serde_json::Value;

use crate::rig::{Rig, bytes};
use crate::{
    ARM, DISARM, EMERGENCY_STOP, GO_RELATIVE, HOVER, NO_THRUST, SETPOINTS_END, STOP, near, position,
};

/// Set-points of cflib's MotionCommander with their times in ms: it takes off, stands still for two seconds,
/// and lands. A line has the height in m, the speed of the landing in m/s, and the packets, recorded on
/// 2026-11-28 with `landing` of comms/crtp/tests/cflib/client.py.
const FLIGHTS: &str = include_str!("vectors/motion_commander.jsonl");
/// `high_level_commander.stop()`.
const HIGH_LEVEL_STOP: &str = "8c0300";
/// `commander.send_setpoint(0, 0, 0, 10000)`, which sinks at 0.35 m/s.
const LITTLE_THRUST: &str = "3c0000000000000000000000001027";

/// Returns a robot that a person armed.
fn armed(seed: u64) -> Rig {
    let mut rig = Rig::new(seed);
    rig.stay(500);
    rig.command(ARM);
    rig.stay(1000);
    rig
}

/// Returns the times in ms and the packets of a flight of this height and speed.
fn flight(height_m: f64, speed_m_s: f64) -> Vec<(u64, String)> {
    let flights = FLIGHTS.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
    let mut flights = flights.filter(|flight| flight[0] == height_m && flight[1] == speed_m_s);
    let flight = flights.next().unwrap();
    let packets = flight[2].as_array().unwrap().iter();
    packets.map(|one| (one[0].as_u64().unwrap(), one[1].as_str().unwrap().to_owned())).collect()
}

/// Sends packets at their times.
fn replay(rig: &mut Rig, packets: &[(u64, String)]) {
    let begin_ms = rig.now_ms;
    for (at_ms, packet) in packets {
        rig.run(begin_ms + at_ms - rig.now_ms);
        rig.send(&bytes(packet));
    }
}

/// Returns the packet of `commander.send_hover_setpoint(0, 0, 0, height)`.
fn hover(height_m: f32) -> String {
    setpoint(0x0a, [0.0, 0.0, 0.0, height_m])
}

/// Returns the packet of a set-point of this type.
fn setpoint(kind: u8, numbers: [f32; 4]) -> String {
    let floats = numbers.map(f32::to_le_bytes).concat();
    floats.iter().fold(format!("7c{kind:02x}"), |digits, byte| format!("{digits}{byte:02x}"))
}

/// Returns a robot that set-points have brought to 0.4 m.
fn hovering(seed: u64) -> Rig {
    let mut rig = armed(seed);
    rig.stream(&hover(0.4), 4000);
    assert!((rig.place_m().z - 0.4).abs() < 0.03, "{}", rig.place_m());
    rig
}

/// The stop comes with the last height. At that time the robot is 0.08 to 0.72 m above the ground, and
/// would fall from there at 1.03 m/s or more.
#[test]
fn the_motion_commander_lands_at_any_speed() {
    let flights = [(0.3, 0.1), (0.3, 0.2), (0.3, 0.5), (0.8, 0.2), (0.8, 0.5), (1.0, 1.0)];
    assert_eq!(FLIGHTS.lines().count(), flights.len());
    for (seed, (height_m, speed_m_s)) in (40..).zip(flights) {
        let mut rig = armed(seed);
        let packets = flight(height_m, speed_m_s);
        replay(&mut rig, &packets);
        let from_m = rig.place_m();
        assert!((0.08..0.8).contains(&from_m.z), "{height_m} m, {speed_m_s} m/s: {from_m}");
        rig.run_until_off(5000);
        rig.assert_whole();
        near(&rig, from_m.with_z(0.0), 0.03);
    }
}

/// A program may take off again. The commander waits for 2.1 s then.
#[test]
fn the_motion_commander_flies_twice() {
    let mut rig = armed(46);
    let packets = flight(0.8, 0.2);
    for _ in 0..2 {
        replay(&mut rig, &packets);
        assert_eq!(rig.stack.stage(), SupervisorStage::Flying);
        rig.stay(2000);
        rig.run(100);
    }
    rig.run_until_off(5000);
    rig.assert_whole();
}

/// A station that is lost in the middle of the descent leaves the landing to the supervisor.
#[test]
fn a_descent_whose_station_is_lost_ends_on_the_ground() {
    for (seed, (height_m, speed_m_s), lost) in
        [(50, (0.3, 0.2), 2), (51, (0.8, 0.5), 4), (52, (0.8, 0.5), 6), (53, (1.0, 1.0), 2)]
    {
        let mut rig = armed(seed);
        let packets = flight(height_m, speed_m_s);
        replay(&mut rig, &packets[..packets.len() - lost]);
        rig.run_until_off(9000);
        rig.assert_whole();
    }
}

/// Programs of other stations end their flights with other set-points, and stops follow one another.
#[test]
fn a_stop_after_any_setpoint_to_the_ground_lands() {
    let flights = [
        // The last height of cflib's older example flowsequenceSync.py.
        (hover(0.04), 300),
        (position(Vec3::ZERO), 300),
        // `send_zdistance_setpoint(0, 0, 0, 0)` and `send_velocity_world_setpoint(0, 0, -0.3, 0)`.
        (setpoint(9, [0.0; 4]), 300),
        (setpoint(8, [0.0, 0.0, -0.3, 0.0]), 1000),
        // The same speed by the altitude hold of Bitcraze's clients (type 4).
        (setpoint(4, [0.0, 0.0, 0.0, -0.3]), 1100),
    ];
    for (seed, (packet, descent_ms)) in (60..).zip(flights) {
        for stop in [STOP, HIGH_LEVEL_STOP] {
            let mut rig = hovering(seed);
            rig.stream(&packet, descent_ms);
            assert!(rig.place_m().z > 0.1, "{packet}: {}", rig.place_m());
            rig.stream(stop, 1000);
            rig.run_until_off(4000);
            rig.assert_whole();
        }
    }
}

/// Stops of a robot that was not sent to the ground just before take effect at once.
#[test]
fn a_stop_elsewhere_turns_the_motors_off_at_once() {
    let descents: [&[(String, u64)]; 6] = [
        &[],
        &[(hover(0.1), 300)],
        &[(hover(0.0), 200), (HOVER.to_owned(), 100)],
        // A velocity that leads to the ground later.
        &[(setpoint(8, [0.0, 0.0, -0.3, 0.0]), 100)],
        &[(hover(0.0), 200), (GO_RELATIVE.to_owned(), 100)],
        // Thrust of a pilot with sticks.
        &[(NO_THRUST.to_owned(), 100), (LITTLE_THRUST.to_owned(), 900)],
    ];
    for (seed, descent) in (70..).zip(descents) {
        let mut rig = hovering(seed);
        for (packet, ms) in descent {
            rig.stream(packet, *ms);
        }
        rig.command(STOP);
        rig.run(20);
        assert!(rig.are_motors_off(), "{descent:?}");
    }
}

/// A set-point to the ground that has expired does not count.
#[test]
fn a_stop_without_fresh_setpoints_turns_the_motors_off_at_once() {
    // One robot levels out, and the other hovers for its station.
    for (seed, has_end) in [(78, false), (79, true)] {
        let mut rig = hovering(seed);
        rig.stream(&hover(0.0), 200);
        if has_end {
            rig.command(SETPOINTS_END);
        }
        rig.run(600);
        assert_eq!(rig.stack.stage() == SupervisorStage::Flying, has_end);
        rig.command(STOP);
        rig.run(20);
        assert!(rig.are_motors_off());
    }
}

/// A person turns the motors off in such a landing, too.
#[test]
fn an_emergency_stop_and_a_disarming_do_not_wait_for_the_ground() {
    for (seed, packet) in [(75, EMERGENCY_STOP), (76, DISARM)] {
        let mut rig = hovering(seed);
        rig.stream(&hover(0.0), 300);
        rig.command(STOP);
        rig.send(&bytes(SETPOINTS_END));
        rig.run(200);
        assert!(!rig.are_motors_off());
        rig.command(packet);
        rig.run(20);
        assert!(rig.are_motors_off(), "{packet}");
    }
}

/// A robot that finds no ground stops as well: its floor is gone.
#[test]
fn a_stop_takes_effect_without_ground() {
    let mut rig = hovering(77);
    rig.stream(&hover(0.0), 300);
    rig.surroundings.ground_m = -20.0;
    rig.command(STOP);
    rig.run(3000);
    assert!(!rig.are_motors_off());
    rig.run(3000);
    assert!(rig.are_motors_off());
}
