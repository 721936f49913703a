//! Flights by packets that cflib 0.1.34 sent for these calls (comms/crtp/tests/vectors), in the physics of a
//! Crazyflie.

#![allow(clippy::unwrap_used, reason = "a failure here fails the test")]

mod landings;
mod owner;
mod rig;

use bittybuzz_crtp::Refusal;
use bittybuzz_flight::arbiter::{CommandBlock, CommandSource};
use bittybuzz_flight::pilot::{PilotAnswer, PilotFunction, PilotMoment};
use bittybuzz_flight::supervisor::{SupervisorLimits, SupervisorStage};
use bittybuzz_flight::{Vec2, Vec3};
use bittybuzz_station::{Outcome, ScriptRank};
use rig::{Rig, bytes};

/// `supervisor.send_arming_request(True)` and `(False)`, `supervisor.send_emergency_stop()`.
const ARM: &str = "9d0101";
const DISARM: &str = "9d0100";
const EMERGENCY_STOP: &str = "9d03";
/// `supervisor.send_emergency_stop_watchdog()`.
const WATCHDOG: &str = "9d04";
/// `high_level_commander.takeoff(0.5, 2.0, 0, 0.0)`.
const TAKE_OFF: &str = "8c07000000003f000000000000000040";
/// `high_level_commander.go_to(1.0, -0.5, 0.75, 3.14, 2.5, True, False, 0)`.
const GO_RELATIVE: &str = "8c0c0001000000803f000000bf0000403fc3f5484000002040";
/// `high_level_commander.land(0.0, 2.0, 0, 1.5)`.
const LAND: &str = "8c0800000000000000c03f0000000040";
/// `commander.send_hover_setpoint(0.2, -0.1, 36.0, 0.4)`.
const HOVER: &str = "7c0acdcc4c3ecdccccbd00001042cdcccc3e";
/// `commander.send_position_setpoint(1.0, -2.0, 0.5, 180.0)`.
const POSITION: &str = "7c070000803f000000c00000003f00003443";
/// `commander.send_velocity_world_setpoint(0, 0, 0.4, 0)`.
const CLIMB: &str = "7c080000000000000000cdcccc3e00000000";
/// `commander.send_setpoint(10.0, 5.0, 30.0, 40000)` and `(0, 0, 0, 0)`.
const THRUST: &str = "3c000020410000a0c00000f041409c";
const NO_THRUST: &str = "3c0000000000000000000000000000";
/// `commander.send_stop_setpoint()` and `send_notify_setpoint_stop(500)`.
const STOP: &str = "7c00";
const SETPOINTS_END: &str = "7d00f4010000";

/// Takes off by a plan of the station.
fn flying(seed: u64) -> Rig {
    let mut rig = Rig::new(seed);
    rig.stay(500);
    rig.command(ARM);
    rig.command(TAKE_OFF);
    rig.stay(4000);
    assert_eq!(rig.stack.stage(), SupervisorStage::Flying);
    assert!((rig.place_m().z - 0.5).abs() < 0.02, "{}", rig.place_m());
    rig
}

fn near(rig: &Rig, place_m: Vec3, tolerance_m: f32) {
    let distance_m = rig.place_m().distance(place_m);
    assert!(distance_m < tolerance_m, "{} is {distance_m} m from {place_m}", rig.place_m());
}

#[test]
fn a_station_plans_a_flight() {
    let mut rig = flying(1);
    rig.command(GO_RELATIVE);
    rig.stay(4000);
    near(&rig, Vec3::new(1.0, -0.5, 1.25), 0.03);
    rig.command(LAND);
    rig.stay(1000);
    // The landing is finished, whatever else the station commands.
    let (outcome, _) = rig.send(&bytes(GO_RELATIVE));
    assert_eq!(outcome, Some(Outcome::Blocked(CommandBlock::Outranked(CommandSource::Landing))));
    rig.run_until_off(6000);
    rig.assert_whole();
}

#[test]
fn nobody_flies_without_a_person() {
    let mut rig = Rig::new(2);
    rig.stay(500);
    assert_eq!(rig.send(&bytes(TAKE_OFF)).0, Some(Outcome::Refused));
    rig.stream(HOVER, 1000);
    assert!(rig.are_motors_off());
    rig.command(ARM);
    rig.command(DISARM);
    assert_eq!(rig.send(&bytes(TAKE_OFF)).0, Some(Outcome::Refused));
    rig.stream(HOVER, 1000);
    assert!(rig.are_motors_off());
}

#[test]
fn setpoints_take_off_and_fly() {
    let mut rig = Rig::new(3);
    rig.stay(500);
    rig.command(ARM);
    rig.stream(HOVER, 3000);
    assert!((rig.place_m().z - 0.4).abs() < 0.03, "{}", rig.place_m());
    rig.stream(POSITION, 8000);
    near(&rig, Vec3::new(1.0, -2.0, 0.5), 0.05);
    rig.command(SETPOINTS_END);
    rig.stay(2000);
    near(&rig, Vec3::new(1.0, -2.0, 0.5), 0.05);
    rig.command(LAND);
    rig.run_until_off(8000);
    rig.assert_whole();
}

#[test]
fn a_stop_turns_the_motors_off() {
    let mut rig = flying(4);
    rig.command(STOP);
    rig.run(20);
    assert!(rig.are_motors_off());
}

#[test]
fn thrust_holds_the_height_after_one_without() {
    let mut rig = flying(5);
    let (outcome, _) = rig.send(&bytes(THRUST));
    assert_eq!(outcome, Some(Outcome::Blocked(CommandBlock::ThrustLocked)));
    rig.command(NO_THRUST);
    assert_eq!(rig.stack.stage(), SupervisorStage::Flying);
    rig.stream(THRUST, 1000);
    // 40,000 climbs at 0.11 m/s, and 10 degrees of roll lead to the right.
    let place_m = rig.place_m();
    assert!((0.53..0.65).contains(&place_m.z) && place_m.y < -0.1, "{place_m}");
    rig.command(NO_THRUST);
    rig.run_until_off(8000);
    rig.assert_whole();
}

#[test]
fn the_loss_of_a_station_lands_a_robot_that_it_flies() {
    let mut rig = flying(6);
    // The script's pilot does not keep the command of the station alive.
    rig.has_script = true;
    rig.run(1400);
    assert!(rig.place_m().z > 0.4, "{}", rig.place_m());
    rig.run_until_off(9000);
    rig.assert_whole();
    // A flight that the supervisor ended needs a person again.
    rig.stay(4000);
    assert_eq!(rig.send(&bytes(TAKE_OFF)).0, Some(Outcome::Refused));
}

/// Returns the packet of `commander.send_position_setpoint(x, y, z, 0)`.
fn position(place_m: Vec3) -> String {
    let floats = [place_m.x, place_m.y, place_m.z, 0.0].map(f32::to_le_bytes).concat();
    floats.iter().fold(String::from("7c07"), |digits, byte| format!("{digits}{byte:02x}"))
}

/// The calls and pauses of cflib's examples/autonomy/autonomous_sequence.py (crazyflie-lib-python
/// a6b0cf2), which wait longer between take-off and first position than set-points last.
#[test]
fn the_autonomous_sequence_of_cflib_flies() {
    let mut rig = Rig::new(14);
    rig.stay(500);
    rig.command(ARM);
    rig.stay(1000);
    rig.stream(CLIMB, 1000);
    rig.stay(1000);
    let corners = [(0.0, 0.0), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5), (-0.5, -0.5), (0.0, 0.0)];
    let high = corners.map(|(x, y)| Vec3::new(x, y, 1.2));
    let low = Vec3::new(0.0, 0.0, 0.4);
    for place_m in [&[low][..], &high, &[low]].concat() {
        rig.stream(&position(place_m), 5000);
        near(&rig, place_m, 0.05);
        assert_eq!(rig.source, CommandSource::Station);
    }
    rig.stream(&position(Vec3::ZERO), 5000);
    rig.command(STOP);
    rig.send(&bytes(SETPOINTS_END));
    rig.run_until_off(5000);
    rig.assert_whole();
}

const LANDING: Option<Outcome> =
    Some(Outcome::Blocked(CommandBlock::Outranked(CommandSource::Supervisor)));

#[test]
fn a_station_that_comes_back_finishes_its_plan() {
    let mut rig = flying(15);
    rig.run(2200);
    assert_eq!(rig.stack.stage(), SupervisorStage::Landing);
    // Other packets do not take the robot back.
    rig.send(&[0xf0, 1]);
    rig.run(20);
    assert_eq!(rig.stack.stage(), SupervisorStage::Landing);
    let from_m = rig.place_m();
    rig.command(GO_RELATIVE);
    rig.stay(6000);
    // The flight starts where the robot has stopped to descend.
    let way_m = rig.place_m() - from_m;
    assert!(way_m.truncate().distance(Vec2::new(1.0, -0.5)) < 0.03, "{way_m}");
    assert!((0.5..0.75).contains(&way_m.z), "{way_m}");
    rig.command(LAND);
    rig.run_until_off(8000);
    rig.assert_whole();
    // The next flight needs a person.
    rig.stay(4000);
    assert_eq!(rig.send(&bytes(TAKE_OFF)).0, Some(Outcome::Refused));
}

#[test]
fn a_robot_on_the_ground_stays_there() {
    let mut rig = Rig::new(16);
    rig.stay(500);
    rig.command(ARM);
    rig.stream(HOVER, 3000);
    let until_ms = rig.now_ms + 8000;
    while rig.place_m().z > 0.035 {
        assert!(rig.now_ms < until_ms, "{}", rig.place_m());
        rig.run(10);
    }
    assert_eq!(rig.stack.stage(), SupervisorStage::Landing);
    rig.stream(HOVER, 200);
    assert!(rig.place_m().z < 0.035, "{}", rig.place_m());
    rig.stream(HOVER, 3000);
    assert!(rig.are_motors_off());
    rig.assert_whole();
}

/// Set-points of the station do not end a landing that has another cause.
#[test]
fn a_landing_for_the_fence_or_the_battery_is_final() {
    use bittybuzz_crtp::Parameter;
    for (seed, is_fence) in [(17, true), (18, false)] {
        let mut rig = Rig::new(seed);
        rig.stay(500);
        rig.command(ARM);
        rig.stream(HOVER, 3000);
        if is_fence {
            // The robot is above the top of the fence.
            rig.send(&write(Parameter::FenceMostZ, 0.05));
        } else {
            rig.battery_v = Some(2.9);
        }
        rig.stream(HOVER, 1300);
        assert_eq!(rig.stack.stage(), SupervisorStage::Landing);
        assert_eq!(rig.send(&bytes(HOVER)).0, LANDING);
        assert_eq!(rig.send(&bytes(GO_RELATIVE)).0, LANDING);
        rig.stream(HOVER, 5000);
        assert!(rig.are_motors_off());
        rig.assert_whole();
    }
}

/// A script that is stuck lands its robot, and a person has to look at it.
#[test]
fn a_station_leaves_the_landing_of_a_stuck_script() {
    let mut rig = flying_by_script(19);
    rig.has_script = false;
    rig.run(1000);
    assert_eq!(rig.stack.stage(), SupervisorStage::Landing);
    assert_eq!(rig.send(&bytes(HOVER)).0, LANDING);
    rig.stream(HOVER, 4000);
    assert!(rig.are_motors_off());
    rig.assert_whole();
}

/// Calls a function of the script.
fn call(rig: &mut Rig, function: PilotFunction, numbers: &[f32]) -> PilotAnswer {
    let moment = PilotMoment { now_ms: rig.now_ms, battery_mv: 4000 };
    let rank = match function {
        PilotFunction::Land => ScriptRank::Landing,
        _ => ScriptRank::Usual,
    };
    let mut aircraft = rig.station.script_aircraft(&mut rig.stack, rank, rig.now_ms);
    rig.pilot.call(function, numbers, false, &mut aircraft, moment)
}

fn flying_by_script(seed: u64) -> Rig {
    let mut rig = Rig::new(seed);
    rig.has_script = true;
    rig.run(500);
    rig.command(ARM);
    assert_eq!(call(&mut rig, PilotFunction::TakeOff, &[500.0]), PilotAnswer::Waiting);
    rig.run(4000);
    assert_eq!(rig.stack.stage(), SupervisorStage::Flying);
    rig
}

#[test]
fn the_loss_of_a_station_leaves_a_flight_of_the_script() {
    let mut rig = flying_by_script(7);
    rig.run(5000);
    assert_eq!((rig.source, rig.stack.stage()), (CommandSource::Script, SupervisorStage::Flying));
}

#[test]
fn a_station_takes_a_robot_from_the_script_and_gives_it_back() {
    let mut rig = flying_by_script(8);
    rig.stream(POSITION, 8000);
    assert_eq!(rig.source, CommandSource::Station);
    near(&rig, Vec3::new(1.0, -2.0, 0.5), 0.05);
    let refused = call(&mut rig, PilotFunction::GoTo, &[0.0, 0.0, 500.0]);
    assert!(matches!(refused, PilotAnswer::Refused { .. }), "{refused:?}");
    rig.stream(POSITION, 500);
    rig.command(SETPOINTS_END);
    call(&mut rig, PilotFunction::GoTo, &[0.0, 0.0, 500.0]);
    rig.run(6000);
    near(&rig, Vec3::new(0.0, 0.0, 0.515), 0.05);
    assert_eq!(rig.source, CommandSource::Script);
}

#[test]
fn the_script_lands_a_robot_that_a_station_flies() {
    let mut rig = flying_by_script(9);
    rig.stream(POSITION, 3000);
    call(&mut rig, PilotFunction::Land, &[]);
    rig.stream(POSITION, 4000);
    rig.run_until_off(5000);
    rig.assert_whole();
}

#[test]
fn an_emergency_stop_lasts_until_power_on() {
    let mut rig = flying(10);
    rig.command(EMERGENCY_STOP);
    rig.run(2);
    assert!(rig.are_motors_off());
    rig.run(3000);
    assert_eq!(rig.stack.stage(), SupervisorStage::Locked);
    assert_eq!(rig.send(&bytes(ARM)).0, Some(Outcome::Refused));
    let refused = rig.send(&bytes(TAKE_OFF)).0;
    let stopped = CommandBlock::Outranked(CommandSource::EmergencyStop);
    assert_eq!(refused, Some(Outcome::Blocked(stopped)));
}

#[test]
fn a_missing_sign_of_life_is_an_emergency_stop() {
    let mut rig = flying(11);
    rig.stream(WATCHDOG, 2000);
    assert_eq!(rig.stack.stage(), SupervisorStage::Flying);
    rig.stay(1500);
    assert!(rig.are_motors_off());
    assert_eq!(rig.source, CommandSource::EmergencyStop);
}

/// Returns the packet that writes a number to the parameter with this id (port 2, channel 2).
fn write(parameter: bittybuzz_crtp::Parameter, value: f32) -> Vec<u8> {
    let id = (parameter as u16).to_le_bytes();
    [&[0x2e], &id[..], &value.to_le_bytes()].concat()
}

#[test]
fn limits_are_only_tightened_in_flight() {
    use bittybuzz_crtp::Parameter;
    let mut rig = flying(12);
    let (outcome, _) = rig.send(&write(Parameter::FenceMostZ, 0.8));
    assert_eq!(outcome, Some(Outcome::Done));
    rig.command(GO_RELATIVE);
    rig.stay(4000);
    near(&rig, Vec3::new(1.0, -0.5, 0.8), 0.03);
    assert_eq!(rig.send(&write(Parameter::FenceMostZ, 5.0)).0, None);
    assert_eq!(rig.station.refusals().of(Refusal::Loosened), 1);
    rig.send(&write(Parameter::PosCtlXVelMax, 0.2));
    rig.send(&write(Parameter::FenceMostX, 1.5));
    // 2 m to the side at 0.2 m/s take longer than the command asks for.
    let mut go = bytes(GO_RELATIVE);
    go[5..9].copy_from_slice(&(-1.0_f32).to_le_bytes());
    assert_eq!(rig.send(&go).0, Some(Outcome::Done));
    let mut fastest_m_s = 0.0_f32;
    for _ in 0..60 {
        rig.stay(500);
        fastest_m_s = fastest_m_s.max(rig.stack.state().velocity_m_s.truncate().length());
    }
    assert!((0.15..0.23).contains(&fastest_m_s), "{fastest_m_s}");
}

#[test]
fn a_station_raises_the_voltages_at_which_a_robot_stays_and_lands() {
    use bittybuzz_crtp::Parameter;
    let mut rig = Rig::new(20);
    rig.battery_v = Some(3.6);
    rig.stay(500);
    rig.command(ARM);
    rig.send(&write(Parameter::PmLowVoltage, 3.7));
    rig.stream(HOVER, 1000);
    assert!(rig.are_motors_off());
    rig.send(&write(Parameter::PmLowVoltage, 3.5));
    rig.stream(HOVER, 3000);
    assert_eq!(rig.stack.stage(), SupervisorStage::Flying);
    rig.send(&write(Parameter::PmCriticalLowVoltage, 3.7));
    rig.stream(HOVER, 1300);
    assert_eq!(rig.stack.stage(), SupervisorStage::Landing);
    assert_eq!(rig.send(&bytes(HOVER)).0, LANDING);
    rig.run_until_off(8000);
    rig.assert_whole();
}

/// The robot's own limits are the lowest.
#[test]
fn no_station_lowers_the_voltages_of_the_robot() {
    use bittybuzz_crtp::Parameter;
    let limits = SupervisorLimits::CRAZYFLIE_2_1_PLUS;
    for (parameter, own_mv) in [
        (Parameter::PmLowVoltage, limits.battery_low_mv),
        (Parameter::PmCriticalLowVoltage, limits.battery_empty_mv),
    ] {
        let own_v = f32::from(own_mv) / 1000.0;
        assert_eq!(parameter.first(), own_v);
        let mut rig = Rig::new(21);
        assert_eq!(rig.send(&write(parameter, own_v - 0.01)).0, None);
        assert_eq!(rig.station.refusals().of(Refusal::OutOfRange), 1);
        assert_eq!(rig.station.parameters().get(parameter).as_f32(), own_v);
        assert_eq!(rig.send(&write(parameter, own_v)).0, Some(Outcome::Done));
    }
}

/// One piece that goes 0.8 m ahead and comes to rest, in 1 s: the fastest moment has 1.75 m/s.
const AHEAD: [f32; 33] = {
    let mut numbers = [0.0; 33];
    // 0.8 m times 35 t^4 - 84 t^5 + 70 t^6 - 20 t^7, the polynomial that begins and ends at rest.
    numbers[4] = 28.0;
    numbers[5] = -67.2;
    numbers[6] = 56.0;
    numbers[7] = -16.0;
    numbers[32] = 1.0;
    numbers
};

/// Writes a trajectory of one piece into the memory (port 4, channel 2), and defines it (port 8, command 6).
fn upload(rig: &mut Rig, piece: &[f32; 33]) {
    let content: Vec<u8> = piece.iter().flat_map(|number| number.to_le_bytes()).collect();
    for (number, part) in content.chunks(24).enumerate() {
        let address = (number as u32 * 24).to_le_bytes();
        let (_, answer) = rig.send(&[&[0x4e, 0], &address[..], part].concat());
        assert_eq!(answer.unwrap().bytes().last(), Some(&0));
    }
    // Id 1, in the memory (1), of uncompressed polynomials (0), from address 0 on, one piece.
    let (_, answer) = rig.send(&[0x8c, 6, 1, 1, 0, 0, 0, 0, 0, 1]);
    assert_eq!(answer.unwrap().bytes().last(), Some(&0));
}

#[test]
fn a_trajectory_waits_for_the_take_off_and_keeps_the_limits() {
    let mut rig = Rig::new(13);
    rig.stay(500);
    upload(&mut rig, &AHEAD);
    rig.command(ARM);
    rig.command(TAKE_OFF);
    rig.stay(1000);
    // `high_level_commander.start_trajectory(1, 1.0, True)`.
    rig.command("8c0d00010000010000803f");
    let mut fastest_m_s = 0.0_f32;
    for _ in 0..14 {
        rig.stay(500);
        fastest_m_s = fastest_m_s.max(rig.stack.state().velocity_m_s.truncate().length());
    }
    near(&rig, Vec3::new(0.8, 0.0, 0.5), 0.03);
    assert!(fastest_m_s < 1.1, "{fastest_m_s} m/s");
}
