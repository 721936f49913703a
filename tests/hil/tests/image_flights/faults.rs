//! The image's flights with one fault each.

use std::fmt::Write;
use std::time::Duration;

use bittybuzz_emulation::message::ResetCause;
use bittybuzz_hil::safety::reset;
use bittybuzz_hil::{
    BodySensor, Command, Core, DeviceFault, DistanceFault, FlowFault, ImuFault, MeasurementFault,
    PoseErrors, Powertrain, Robot, TraceLog,
};
use bittybuzz_random::Random;

use super::course::{attach_flow_deck, motor_changes, rows};
use super::fault::{FaultKind, PositionSource, Scenario};
use super::fresh::{numbers, print_count, print_worst};
use crate::flight::{are_off, arm, firmware_log, last_motion, motions};

/// Kinds of faults after which a flight begins again.
const KINDS: usize = FaultKind::ALL.len();
/// Steps of the script, each of 100 ms: the first one in the air, those of a leg, and those for which the
/// pilot flies on after a fault.
const FIRST_STEP: u64 = 26;
const LEG_STEPS: u64 = 12;
const STEPS_AFTER_FAULT: u64 = 70;
/// Legs of a flight at most.
const LEGS: u64 = 14;
/// Time in ms in which a robot with a fault ends its flight, and that for which it is observed then.
const AFTER_FAULT_MS: u64 = 45_000;
const OBSERVED_MS: u64 = 2_000;
/// Longest time in ms until motors are off after a fault of the inertial sensors, and after a crash, which is
/// reported each 20 ms.
const IMU_OFF_MS: f64 = 50.0;
const CRASH_OFF_MS: f64 = 220.0;
/// Least share of flights that land upright in spite of another fault.
const LANDED_MIN: f64 = 0.95;

/// A fault as the emulator knows it.
#[derive(Clone, Debug)]
enum ImageFault {
    /// Commands to the emulator.
    Commands(Vec<Command>),
    /// The STM32 is reset.
    Reset(ResetCause),
    /// A statement of the script in its step `STEP`.
    Script(&'static str),
}

/// Flights of the host without commands have faults here that only the image has: a bus that sticks, and a
/// reset.
fn fault(scenario: &Scenario) -> ImageFault {
    let round = scenario.number / KINDS;
    let measured = |sensor, fault| Command::BodyFault { sensor, fault: Some(fault) };
    let device = |fault| Command::DeviceFault { fault };
    let noisy = MeasurementFault::Noisy(scenario.noise_factor);
    let imu = |fault| device(DeviceFault::Imu(Some(fault)));
    let poses = |errors| Command::PoseErrors(errors);
    let usual = PoseErrors { seed: scenario.seed, ..PoseErrors::default() };
    let command = match scenario.kind {
        FaultKind::ImuStuck => imu(ImuFault::FrozenData),
        FaultKind::ImuNoisy => measured(BodySensor::Inertial, noisy),
        FaultKind::ImuSilent if round.is_multiple_of(2) => imu(ImuFault::NoAcknowledge),
        FaultKind::ImuSilent => imu(ImuFault::NoDataReady),
        FaultKind::FlowStuck => device(DeviceFault::Flow(Some(FlowFault::FrozenData))),
        FaultKind::FlowNoisy => measured(BodySensor::Flow, noisy),
        FaultKind::FlowSilent => device(DeviceFault::Flow(Some(FlowFault::NoAnswer))),
        FaultKind::RangeStuck => device(DeviceFault::Distance(Some(DistanceFault::FrozenData))),
        FaultKind::RangeNoisy => measured(BodySensor::Distance, noisy),
        FaultKind::RangeSilent => device(DeviceFault::Distance(Some(DistanceFault::NoMeasurement))),
        FaultKind::CaptureStuck => measured(BodySensor::Poses, MeasurementFault::Stuck),
        FaultKind::CaptureNoisy => measured(BodySensor::Poses, noisy),
        FaultKind::CaptureSilent => measured(BodySensor::Poses, MeasurementFault::Silent),
        FaultKind::PosesLost => poses(PoseErrors { lose: scenario.loss, ..usual }),
        FaultKind::PoseJump => {
            let jump_mm = (scenario.jump_m * 1000.0).to_array();
            poses(PoseErrors { jump_mm, ..usual })
        }
        FaultKind::WeakMotor => {
            let mut thrust_shares = [1.0; 4];
            thrust_shares[scenario.motor] = 0.8;
            Command::Powertrain(Powertrain { thrust_shares, charge: None })
        }
        FaultKind::EmptyBattery => match scenario.volts {
            Some(volts) => {
                let volts = volts as f32;
                Command::Battery { volts, charging: false, usb_powered: false }
            }
            None => {
                let charge = Some(scenario.charge);
                Command::Powertrain(Powertrain { charge, ..Powertrain::default() })
            }
        },
        FaultKind::ScriptFault => return ImageFault::Script("n = nil + 1"),
        FaultKind::StuckScript => return ImageFault::Script("while(1) n = n"),
        FaultKind::CommandsLost => match round % 5 {
            // The clock pulses of a bus clear end it.
            0 | 3 => imu(ImuFault::SdaLow(9)),
            1 => return ImageFault::Reset(ResetCause::Pin),
            2 => imu(ImuFault::SdaLow(u32::MAX)),
            _ => return ImageFault::Reset(ResetCause::Software),
        },
    };
    ImageFault::Commands(vec![command])
}

/// Returns true if the motors stop at once and the robot falls.
fn falls(fault: &ImageFault, kind: FaultKind) -> bool {
    let is_held = |command: &Command| {
        *command
            == Command::DeviceFault { fault: DeviceFault::Imu(Some(ImuFault::SdaLow(u32::MAX))) }
    };
    match fault {
        ImageFault::Reset(_) => true,
        ImageFault::Commands(commands) => kind.is_imu_fault() || commands.iter().any(is_held),
        ImageFault::Script(_) => false,
    }
}

/// Returns the script that takes off, and flies to random places; `statement` is that of the step `STEP`.
fn script(scenario: &Scenario, statement: Option<&str>) -> String {
    let mut random: Random = scenario.pilot.clone();
    let mut between = |least: f64, most: f64| least + (most - least) * random.unit();
    let fault_step = FIRST_STEP + (scenario.fault_after_s * 10.0) as u64;
    let mut script = String::from(
        "function init() { n = 0 }\nfunction step() {\n n = n + 1\n if(n == 25) log(1, takeoff(700.0))\n",
    );
    for leg in 0..LEGS {
        let (from, to) = (FIRST_STEP + leg * LEG_STEPS, FIRST_STEP + (leg + 1) * LEG_STEPS);
        let [x, y, z] = [(-700.0, 700.0), (-700.0, 700.0), (500.0, 1000.0)]
            .map(|(least, most)| between(least, most));
        let last = (fault_step + STEPS_AFTER_FAULT).min(to);
        writeln!(script, " if(n > {from} and n <= {last}) goto({x:.1}, {y:.1}, {z:.1})").unwrap();
    }
    writeln!(script, " if(n == {fault_step}) {{ log(2) {} }}", statement.unwrap_or("")).unwrap();
    writeln!(script, " if(n == {}) land()\n}}", fault_step + STEPS_AFTER_FAULT).unwrap();
    script
}

/// What was observed.
#[derive(Debug)]
struct Observations {
    /// Height at the time of the fault in m.
    fault_height_m: f64,
    /// Time in ms from the fault until motors were off for good; `None` if they never were.
    off_after_ms: Option<f64>,
    /// Time in ms from a crash until motors were off for good.
    off_after_crash_ms: Option<f64>,
    has_crashed: bool,
    /// The robot stands on its feet.
    stands: bool,
    /// Lines of the firmware's log since the fault, for the output.
    #[expect(dead_code, reason = "it is printed")]
    log: Vec<String>,
}

/// Flies a scenario to its end.
fn fly(scenario: &Scenario) -> Observations {
    let fault = fault(scenario);
    let statement = match fault {
        ImageFault::Script(statement) => Some(statement),
        _ => None,
    };
    let mut robot = Robot::crazyflie(Core::Unicorn, &script(scenario, statement));
    let has_poses = scenario.source == PositionSource::MotionCapture;
    if !has_poses {
        attach_flow_deck(&mut robot);
    }
    robot.execute(&Command::Body {
        seed: scenario.seed,
        x_mm: 0.0,
        y_mm: 0.0,
        yaw_degrees: 0.0,
        pose_ms: if has_poses { 10 } else { 0 },
        pose_noise_mm: 0.5,
        pose_noise_degrees: 0.005_f64.to_degrees(),
    });
    robot.run_ms(2_000);
    arm(&mut robot);
    let latest = robot.now() + Duration::from_secs(20);
    let at = loop {
        let log = TraceLog::of_events(&robot.events);
        if let Some(row) = rows(&log).iter().find(|row| row.mark == 2) {
            let up = rows(&log).into_iter().find(|row| row.mark == 1).unwrap();
            assert_eq!(up.numbers, [1.0], "{scenario:?} does not take off: {:?}", log.firmware);
            break row.at;
        }
        assert!(robot.now() < latest, "{scenario:?}: {:?} {:?}", log.log, log.firmware);
        robot.run_ms(50);
    };
    let lines = firmware_log(&robot).len();
    let fault_height_m = last_motion(&robot).position_m[2];
    // A statement of the script acts in its step; commands act now.
    let at = if statement.is_some() { at } else { robot.now() };
    match fault {
        ImageFault::Commands(commands) => {
            commands.iter().for_each(|command| robot.execute(command))
        }
        ImageFault::Reset(cause) => {
            reset(&mut robot, cause);
        }
        ImageFault::Script(_) => {}
    }
    let latest = at + Duration::from_millis(AFTER_FAULT_MS);
    while !are_off(&robot) && robot.now() < latest {
        robot.run_ms(100);
    }
    robot.run_ms(OBSERVED_MS);
    let off_at = are_off(&robot).then(|| {
        let last = motor_changes(&robot).last();
        last.map_or(at, |(at, ..)| at)
    });
    let crash = motions(&robot.events).into_iter().find(|motion| motion.has_crashed);
    let after_ms = |off: Duration, from: Duration| off.saturating_sub(from).as_secs_f64() * 1e3;
    let last = last_motion(&robot);
    let [x, y, ..] = last.attitude;
    // The share of the body's up that is up: less than 0.1 rad.
    let up = 1.0 - 2.0 * (x * x + y * y);
    Observations {
        fault_height_m,
        off_after_ms: off_at.map(|off| after_ms(off, at)),
        off_after_crash_ms: crash.as_ref().and_then(|crash| Some(after_ms(off_at?, crash.at))),
        has_crashed: crash.is_some(),
        stands: up > 0.1_f64.cos() && last.position_m[2] < 0.03,
        log: firmware_log(&robot).split_off(lines),
    }
}

/// Returns the limits that a flight broke.
fn broken(scenario: &Scenario, found: &Observations) -> Vec<&'static str> {
    let falls = falls(&fault(scenario), scenario.kind);
    let mut broken = Vec::new();
    let mut require = |holds: bool, limit: &'static str| {
        if !holds {
            broken.push(limit);
        }
    };
    require(found.fault_height_m > 0.3, "flies at the time of the fault");
    require(found.off_after_ms.is_some(), "motors off in the end");
    if found.has_crashed && !falls {
        require(
            found.off_after_crash_ms.is_some_and(|ms| ms <= CRASH_OFF_MS),
            "motors off after a crash",
        );
    }
    if falls {
        require(
            found.off_after_ms.is_some_and(|ms| ms <= IMU_OFF_MS),
            "motors off after the fault",
        );
    }
    broken
}

/// Flies the scenarios of these numbers, and asserts their limits at the end.
fn fly_all(numbers: std::ops::Range<usize>) {
    let (mut all, mut bad) = (Vec::new(), Vec::new());
    for number in numbers {
        let scenario = Scenario::new(number);
        let found = fly(&scenario);
        let limits = broken(&scenario, &found);
        let fault = fault(&scenario);
        println!(
            "flight {number}, {:?} with {:?}: {fault:?} {limits:?} {found:?}",
            scenario.kind, scenario.source
        );
        if !limits.is_empty() {
            bad.push(number);
        }
        all.push((scenario, fault, found));
    }
    let falling = || all.iter().filter(|(scenario, fault, _)| falls(fault, scenario.kind));
    let landing = || all.iter().filter(|(scenario, fault, _)| !falls(fault, scenario.kind));
    let has_landed = |found: &Observations| found.stands && !found.has_crashed;
    let landed = landing().filter(|(.., found)| has_landed(found)).count();
    print_worst(
        "ms until motors are off after a fault of the inertial sensors, the bus or a reset",
        falling().map(|(scenario, _, found)| (scenario.number, found.off_after_ms.map(f64::ceil))),
    );
    print_count("can land", landing().count());
    print_count("land upright", landed);
    assert!(bad.is_empty(), "{bad:?}");
    let (landed, all) = (landed as f64, landing().count() as f64);
    assert!(all == 0.0 || landed >= (LANDED_MIN * all).floor(), "{landed} of {all} landed");
}

/// A bus whose data line sticks until it is cleared: the robot flies on, and lands when the script says so.
#[test]
fn the_image_lands_after_a_bus_that_sticks() {
    fly_all(6_094..6_095);
}

/// A reset in the air stops the motors, and the robot falls.
#[test]
fn the_image_stops_its_motors_after_a_reset_in_the_air() {
    fly_all(6_018..6_019);
}

#[test]
#[ignore = "`cargo xtask soak image_flights` runs it"]
fn fresh_flights_with_a_fault() {
    fly_all(numbers());
}
