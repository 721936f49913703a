//! Flights of a robot that follows its references without an error.

use super::*;
use crate::avoidance::AvoidanceSettings;
use std::format;
use std::string::ToString;

const SETTINGS: PilotSettings = PilotSettings { standing_m: 0.0, ..PilotSettings::CRAZYFLIE };
const PERIOD_MS: u64 = 100;

/// A robot with a pilot, and a script that calls functions.
struct Robot {
    pilot: Pilot,
    aircraft: PlannedAircraft,
    position_m: Vec3,
    yaw_rad: f32,
    now_ms: u64,
    battery_mv: u16,
    top_m: f32,
}

impl Robot {
    /// A robot that a person armed.
    fn armed() -> Self {
        let mut robot = Robot::new();
        robot.pilot.permit(0);
        robot
    }

    fn new() -> Self {
        Robot {
            pilot: Pilot::new(SETTINGS),
            aircraft: PlannedAircraft::new(SETTINGS.limits).expect("the limits are positive"),
            position_m: Vec3::ZERO,
            yaw_rad: 0.0,
            now_ms: 0,
            battery_mv: 4000,
            top_m: 0.0,
        }
    }

    fn moment(&self) -> PilotMoment {
        PilotMoment { now_ms: self.now_ms, battery_mv: self.battery_mv }
    }

    /// Lets the pilot and the body act for a tick.
    fn tick(&mut self) {
        self.aircraft.sense(self.now_ms, Some((self.position_m, self.yaw_rad)));
        let moment = self.moment();
        self.pilot.tick(&mut self.aircraft, moment);
        let period_s = PERIOD_MS as f32 / 1000.0;
        match self.aircraft.steer(0.0, period_s) {
            Some(command) => {
                self.position_m += command.velocity_m_s * period_s;
                self.yaw_rad += command.yaw_rate_rad_s * period_s;
            }
            None => self.position_m.z = 0.0,
        }
        self.position_m.z = self.position_m.z.max(0.0);
        self.top_m = self.top_m.max(self.position_m.z);
        self.now_ms += PERIOD_MS;
    }

    fn wait(&mut self, ticks: u32) {
        (0..ticks).for_each(|_| self.tick());
    }

    /// Calls a function once.
    fn begin(&mut self, function: PilotFunction, numbers: &[f32]) -> PilotAnswer {
        self.aircraft.sense(self.now_ms, Some((self.position_m, self.yaw_rad)));
        let moment = self.moment();
        self.pilot.call(function, numbers, false, &mut self.aircraft, moment)
    }

    /// Calls a function until it is done, and returns the answer and the duration in ms.
    fn call(&mut self, function: PilotFunction, numbers: &[f32]) -> (PilotAnswer, u64) {
        let begin_ms = self.now_ms;
        let mut answer = self.begin(function, numbers);
        while answer == PilotAnswer::Waiting {
            self.tick();
            self.aircraft.sense(self.now_ms, Some((self.position_m, self.yaw_rad)));
            let moment = self.moment();
            answer = self.pilot.call(function, numbers, true, &mut self.aircraft, moment);
            assert!(self.now_ms - begin_ms < 120_000, "{function:?} does not end");
        }
        (answer, self.now_ms - begin_ms)
    }

    fn take_off(&mut self) {
        let (answer, _) = self.call(PilotFunction::TakeOff, &[500.0]);
        assert_eq!(answer, PilotAnswer::Done(true));
    }
}

fn refused(reason: PilotRefusal, is_new: bool) -> PilotAnswer {
    PilotAnswer::Refused { reason, is_new }
}

#[test]
fn a_script_does_not_take_off_without_a_person() {
    let mut robot = Robot::new();
    let answer = robot.begin(PilotFunction::TakeOff, &[500.0]);
    assert_eq!(answer, refused(PilotRefusal::NotArmed, true));
    let answer = robot.begin(PilotFunction::TakeOff, &[500.0]);
    assert_eq!(answer, refused(PilotRefusal::NotArmed, false));
    for (_, function) in PilotFunction::ALL {
        robot.begin(function, &[500.0, 0.0, 500.0]);
        robot.wait(50);
    }
    assert_eq!(robot.top_m, 0.0);
    robot.pilot.permit(robot.now_ms);
    robot.take_off();
}

#[test]
fn a_weak_battery_ends_the_permission_at_take_off() {
    let mut robot = Robot::armed();
    robot.battery_mv = 3199;
    let reason = PilotRefusal::BatteryLow { battery_mv: 3199, needed_mv: 3200 };
    assert_eq!(robot.begin(PilotFunction::TakeOff, &[500.0]), refused(reason, true));
    robot.battery_mv = 4000;
    let reason = PilotRefusal::Ended(PermissionEnd::Battery);
    assert_eq!(robot.begin(PilotFunction::TakeOff, &[500.0]), refused(reason, true));
    assert!(reason.to_string().contains("battery"), "{reason}");
}

#[test]
fn a_landing_of_the_script_keeps_the_permission() {
    let mut robot = Robot::armed();
    for _ in 0..3 {
        robot.take_off();
        assert!((robot.position_m.z - 0.5).abs() < 0.05, "{}", robot.position_m);
        let (answer, _) = robot.call(PilotFunction::Land, &[]);
        assert_eq!(answer, PilotAnswer::Done(true));
        assert_eq!(robot.position_m.z, 0.0);
    }
}

#[test]
fn a_permission_lasts_for_half_an_hour() {
    let mut robot = Robot::armed();
    robot.now_ms = PERMISSION_MS - 5000;
    robot.take_off();
    robot.wait(100);
    // It ends in flight, which goes on.
    assert!((robot.position_m.z - 0.5).abs() < 0.05, "{}", robot.position_m);
    robot.call(PilotFunction::Land, &[]);
    let reason = PilotRefusal::Ended(PermissionEnd::Time);
    assert_eq!(robot.begin(PilotFunction::TakeOff, &[500.0]), refused(reason, true));
}

/// The robot lands, and a restart of the script does not let it take off again.
#[test]
fn a_fault_of_the_script_ends_flight_and_permission() {
    let mut robot = Robot::armed();
    robot.take_off();
    robot.pilot.set_script_fault(true);
    robot.wait(50);
    assert_eq!(robot.position_m.z, 0.0);
    robot.pilot.set_script_fault(false);
    let reason = PilotRefusal::Ended(PermissionEnd::ScriptFault);
    assert_eq!(robot.begin(PilotFunction::TakeOff, &[500.0]), refused(reason, true));
    assert_eq!(robot.begin(PilotFunction::TakeOff, &[500.0]), refused(reason, false));
    assert_eq!(robot.begin(PilotFunction::GoTo, &[1.0, 0.0, 500.0]), refused(reason, true));
}

/// A robot that has armed, and not yet taken off, disarms.
#[test]
fn a_permission_that_ends_stops_a_take_off() {
    let mut robot = Robot::armed();
    assert_eq!(robot.begin(PilotFunction::TakeOff, &[500.0]), PilotAnswer::Waiting);
    robot.tick();
    assert_eq!(robot.aircraft.status().stage, SupervisorStage::Armed);
    robot.pilot.set_script_fault(true);
    robot.tick();
    assert_eq!(robot.aircraft.status().stage, SupervisorStage::Ready);
    let moment = robot.moment();
    let take_off = PilotFunction::TakeOff;
    let answer = robot.pilot.call(take_off, &[500.0], true, &mut robot.aircraft, moment);
    assert_eq!(answer, refused(PilotRefusal::Ended(PermissionEnd::ScriptFault), true));
    robot.wait(50);
    assert_eq!(robot.top_m, 0.0);
}

#[test]
fn an_empty_battery_ends_the_flight_after_five_seconds() {
    let mut robot = Robot::armed();
    robot.take_off();
    robot.battery_mv = 3099;
    robot.wait(49);
    assert!((robot.position_m.z - 0.5).abs() < 0.05, "{}", robot.position_m);
    robot.wait(50);
    assert_eq!(robot.position_m.z, 0.0);
    assert_eq!(robot.pilot.permission(), Permission::Ended(PermissionEnd::Battery));
}

/// A polynomial of degree 7 from rest to rest is 35/16 times as fast at its middle as on average.
#[test]
fn a_flight_to_a_place_takes_the_planners_shortest_time() {
    for meters in [1.0, 3.0, 5.0] {
        let mut robot = Robot::armed();
        robot.take_off();
        let (answer, took_ms) = robot.call(PilotFunction::GoTo, &[meters * 1000.0, 0.0, 500.0]);
        assert_eq!(answer, PilotAnswer::Done(true));
        let plan_ms = (meters / SETTINGS.limits.speed_m_s * 35.0 / 16.0 * 1000.0) as u64;
        // The function returns in a tick.
        assert!((plan_ms..plan_ms + 2 * PERIOD_MS).contains(&took_ms), "{meters} m: {took_ms} ms");
        assert!((robot.position_m - Vec3::new(meters, 0.0, 0.5)).length() < 0.05);
    }
}

/// A robot that cannot reach its goal returns 0 a second after the plan's end.
#[test]
fn a_flight_that_is_held_back_ends_a_second_after_its_plan() {
    let mut robot = Robot::armed();
    robot.take_off();
    let begin_ms = robot.now_ms;
    let numbers = [1000.0, 0.0, 500.0];
    let mut answer = robot.begin(PilotFunction::GoTo, &numbers);
    while answer == PilotAnswer::Waiting {
        robot.tick();
        // A string holds the robot.
        robot.position_m.x = robot.position_m.x.min(0.5);
        robot.aircraft.sense(robot.now_ms, Some((robot.position_m, robot.yaw_rad)));
        let moment = robot.moment();
        answer = robot.pilot.call(PilotFunction::GoTo, &numbers, true, &mut robot.aircraft, moment);
    }
    assert_eq!(answer, PilotAnswer::Done(false));
    let took_ms = robot.now_ms - begin_ms;
    assert!((3187..3400).contains(&took_ms), "{took_ms} ms");
}

/// A robot that lands above another one stays away from it, and lands once that one has gone. The
/// ellipsoid of a robot is 0.3 m wide and 0.9 m high, and two keep twice that.
#[test]
fn a_landing_gives_way_to_a_robot_below() {
    let mut robot = Robot::armed();
    robot.pilot.set_avoidance(Avoidance::new(0, AvoidanceSettings::CRAZYFLIE));
    let (answer, _) = robot.call(PilotFunction::TakeOff, &[2500.0]);
    assert_eq!(answer, PilotAnswer::Done(true));
    assert_eq!(robot.begin(PilotFunction::Land, &[]), PilotAnswer::Waiting);
    let below_m = Vec3::new(0.0, 0.0, 0.5);
    for _ in 0..60 {
        let report = PeerReport {
            id: 1,
            position_m: below_m,
            velocity_m_s: None,
            measured_at_ms: robot.now_ms as u32,
        };
        let updated = robot.pilot.update_peer(report, &mut robot.aircraft);
        updated.expect("the report is of another robot");
        robot.tick();
        let apart = (robot.position_m - below_m) / Vec3::new(0.6, 0.6, 1.8);
        assert!(apart.length() > 0.95, "{}", robot.position_m);
    }
    assert!(robot.position_m.z > 0.1, "{}", robot.position_m);
    // Reports are forgotten after 5 s.
    robot.wait(150);
    assert_eq!(robot.position_m.z, 0.0);
    let (answer, _) = robot.call(PilotFunction::TakeOff, &[500.0]);
    assert_eq!(answer, PilotAnswer::Done(true));
}

#[test]
fn other_functions_follow_the_robot_file() {
    let mut robot = Robot::armed();
    assert_eq!(robot.begin(PilotFunction::TakeOff, &[0.0]), PilotAnswer::OutOfRange);
    // 800 mm in 60 steps of 100 ms.
    let (answer, took_ms) = robot.call(PilotFunction::TakeOff, &[800.0, 60.0]);
    assert_eq!(answer, PilotAnswer::Done(true));
    assert!((6000..6400).contains(&took_ms), "{took_ms} ms");
    robot.begin(PilotFunction::Hover, &[600.0]);
    robot.wait(30);
    assert!((robot.position_m.z - 0.6).abs() < 0.02, "{}", robot.position_m);
    robot.begin(PilotFunction::Left, &[]);
    robot.wait(20);
    let before_rad = robot.yaw_rad;
    robot.wait(10);
    let turned_rad = robot.yaw_rad - before_rad;
    assert!((turned_rad - SETTINGS.turn_rad_s).abs() < 0.01, "{turned_rad} rad");
    let (_, took_ms) = robot.call(PilotFunction::Spin, &[600.0, 90.0]);
    assert_eq!(took_ms, SPIN_MS);
    // Back to yaw 0 and to a place.
    let (answer, _) = robot.call(PilotFunction::GoTo, &[0.0, 0.0, 600.0]);
    assert_eq!(answer, PilotAnswer::Done(true));
    robot.wait(20);
    assert!(robot.yaw_rad.abs() < 0.05, "{} rad", robot.yaw_rad);
    robot.begin(PilotFunction::Forward, &[]);
    robot.wait(20);
    let before_m = robot.position_m.x;
    robot.wait(10);
    let way_m = robot.position_m.x - before_m;
    assert!((way_m - SETTINGS.cruise_m_s).abs() < 0.01, "{way_m} m");
    assert_eq!(robot.begin(PilotFunction::Approach, &[0.0, 0.0]), PilotAnswer::Done(false));
    robot.wait(60);
    assert_eq!(robot.begin(PilotFunction::Approach, &[0.0, 0.0]), PilotAnswer::Done(true));
    assert!((robot.position_m.z - 0.6).abs() < 0.02, "{}", robot.position_m);
}

#[test]
fn numbers_that_are_not_finite_move_nothing() {
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let mut robot = Robot::armed();
        robot.take_off();
        for (_, function) in PilotFunction::ALL {
            let answer = robot.begin(function, &[100.0, bad]);
            assert!(matches!(answer, PilotAnswer::Refused { .. }), "{function:?}: {answer:?}");
            robot.wait(10);
            let off_m = robot.position_m.distance(Vec3::new(0.0, 0.0, 0.5));
            assert!(off_m < 0.02, "{function:?}: {}", robot.position_m);
        }
    }
}

#[test]
fn every_refusal_has_a_text() {
    for reason in [
        PilotRefusal::NotArmed,
        PilotRefusal::Ended(PermissionEnd::Fault),
        PilotRefusal::Ended(PermissionEnd::Crash),
        PilotRefusal::Ended(PermissionEnd::Time),
        PilotRefusal::NotReady,
        PilotRefusal::NotFlying,
        PilotRefusal::NoPosition,
        PilotRefusal::Plan(crate::planner::PlanError::TooFar),
    ] {
        assert!(format!("{reason}").len() > 10);
    }
}
