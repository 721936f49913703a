//! The commands that calls of cflib mean, worked out from cflib's documentation of its arguments.

use bittybuzz_crtp::{
    ArmingRequest, Command, FullState, Height, HighLevelCommand, Localization, MeasuredPose, Pace,
    Setpoint, ThrustSetpoint, Tilt, Vertical, VerticalFlight,
};
use serde_json::Value;

/// A command without the answer in it.
#[derive(Clone, Debug, PartialEq)]
pub enum Meaning {
    Setpoint(Setpoint),
    SetpointsEnd,
    HighLevel(HighLevelCommand),
    Arming(ArmingRequest),
    EmergencyStop,
    EmergencyStopWatchdog,
    Localization(Localization),
    Notification(bool),
    /// The robot answers the packet and has no command.
    Nothing,
}

/// Returns the meaning of a command.
pub fn meaning(command: Option<Command>) -> Meaning {
    match command {
        None => Meaning::Nothing,
        Some(Command::Setpoint(setpoint)) => Meaning::Setpoint(setpoint),
        Some(Command::SetpointsEnd) => Meaning::SetpointsEnd,
        Some(Command::HighLevel(command, _)) => Meaning::HighLevel(command),
        Some(Command::Arming(request, _)) => Meaning::Arming(request),
        Some(Command::EmergencyStop) => Meaning::EmergencyStop,
        Some(Command::EmergencyStopWatchdog) => Meaning::EmergencyStopWatchdog,
        Some(Command::Localization(localization)) => Meaning::Localization(localization),
        Some(Command::Notification { is_success }) => Meaning::Notification(is_success),
        Some(Command::Parameter(change)) => panic!("cflib wrote a parameter: {change:?}"),
    }
}

/// The arguments of a call.
struct Arguments<'a>(std::slice::Iter<'a, Value>);

impl Arguments<'_> {
    fn number(&mut self) -> f32 {
        self.0.next().unwrap().as_f64().unwrap() as f32
    }

    fn degrees(&mut self) -> f32 {
        self.number().to_radians()
    }

    fn integer(&mut self) -> u64 {
        self.0.next().unwrap().as_u64().unwrap()
    }

    fn flag(&mut self) -> bool {
        self.0.next().unwrap().as_bool().unwrap()
    }

    /// A list of numbers.
    fn vector<const N: usize>(&mut self) -> [f64; N] {
        let list = self.0.next().unwrap().as_array().unwrap();
        let numbers: Vec<f64> = list.iter().map(|number| number.as_f64().unwrap()).collect();
        numbers.try_into().unwrap()
    }

    /// A yaw, or nothing for the present one.
    fn yaw(&mut self) -> Option<f32> {
        self.0.next().unwrap().as_f64().map(|yaw| yaw as f32)
    }
}

/// Returns thousandths without a fraction, as cflib sends them.
fn thousandths<const N: usize>(numbers: [f64; N]) -> [f32; N] {
    numbers.map(|number| (number * 1000.0) as i16 as f32 / 1000.0)
}

fn single<const N: usize>(numbers: [f64; N]) -> [f32; N] {
    numbers.map(|number| number as f32)
}

/// Returns the meaning of a call, or `None` if it is one of trajectories, which depends on the memory.
pub fn expected(path: &str, arguments: &Value) -> Meaning {
    let mut a = Arguments(arguments.as_array().unwrap().iter());
    match path {
        // "roll, pitch are in degrees, yawrate is in degrees/s". A positive pitch flies ahead. The
        // sign of the rate is that of the firmware, which inverts it (crtp_commander_rpyt.c).
        "commander.send_setpoint" => {
            let tilt = Tilt::Angle { roll_rad: a.degrees(), pitch_rad: a.degrees() };
            let yaw_rate_rad_s = -a.degrees();
            let thrust = a.integer() as u16;
            Meaning::Setpoint(Setpoint::Thrust(ThrustSetpoint { tilt, yaw_rate_rad_s, thrust }))
        }
        "commander.send_setpoint_manual" => {
            let (roll, pitch, yaw_rate_rad_s) = (a.degrees(), a.degrees(), a.degrees());
            let percent = f64::from(a.number());
            // "ranging from 0 (next to no power) to 100 (full power)": 10,001 to 60,000.
            let thrust = (10_001.0 + 0.01 * percent * (60_000.0 - 10_001.0)) as u16;
            let tilt = if a.flag() {
                Tilt::Rate { roll_rad_s: roll, pitch_rad_s: pitch }
            } else {
                Tilt::Angle { roll_rad: roll, pitch_rad: pitch }
            };
            Meaning::Setpoint(Setpoint::Thrust(ThrustSetpoint { tilt, yaw_rate_rad_s, thrust }))
        }
        "commander.send_notify_setpoint_stop" => Meaning::SetpointsEnd,
        "commander.send_stop_setpoint" => Meaning::Setpoint(Setpoint::Stop),
        // "vx, vy, vz are in m/s, yawrate is in degrees/s"
        "commander.send_velocity_world_setpoint" => Meaning::Setpoint(Setpoint::Velocity {
            velocity_m_s: [a.number(), a.number(), a.number()],
            yaw_rate_rad_s: a.degrees(),
        }),
        // The pitch of this call is the firmware's: positive with the nose up.
        "commander.send_zdistance_setpoint" => Meaning::Setpoint(Setpoint::Attitude {
            roll_rad: a.degrees(),
            pitch_rad: -a.degrees(),
            yaw_rate_rad_s: a.degrees(),
            vertical: Vertical::HeightM(a.number()),
        }),
        "commander.send_hover_setpoint" => Meaning::Setpoint(Setpoint::Hover {
            ahead_m_s: a.number(),
            left_m_s: a.number(),
            yaw_rate_rad_s: a.degrees(),
            height_m: a.number(),
        }),
        "commander.send_full_state_setpoint" => {
            let [position_m, velocity_m_s, acceleration_m_s2] =
                [a.vector(), a.vector(), a.vector()].map(thousandths);
            let quaternion = single(a.vector());
            // cflib documents degrees per second, and sends thousandths of what it gets; the
            // firmware reads thousandths of a radian.
            let rates = [a.number(), a.number(), a.number()].map(f64::from);
            let rates_rad_s = thousandths(rates);
            Meaning::Setpoint(Setpoint::FullState(FullState {
                position_m,
                velocity_m_s,
                acceleration_m_s2,
                quaternion,
                rates_rad_s,
            }))
        }
        "commander.send_position_setpoint" => Meaning::Setpoint(Setpoint::Position {
            position_m: [a.number(), a.number(), a.number()],
            yaw_rad: a.degrees(),
        }),
        "high_level_commander.takeoff" => {
            Meaning::HighLevel(HighLevelCommand::TakeOff(vertical(&mut a)))
        }
        "high_level_commander.land" => Meaning::HighLevel(HighLevelCommand::Land(vertical(&mut a))),
        "high_level_commander.stop" => Meaning::HighLevel(HighLevelCommand::Stop),
        "high_level_commander.go_to" => Meaning::HighLevel(HighLevelCommand::GoTo {
            position_m: [a.number(), a.number(), a.number()],
            yaw_rad: a.number(),
            duration_s: a.number(),
            is_relative: a.flag(),
            is_linear: a.flag(),
        }),
        "high_level_commander.spiral" => Meaning::HighLevel(HighLevelCommand::Spiral {
            angle_rad: a.number(),
            first_radius_m: a.number(),
            last_radius_m: a.number(),
            climb_m: a.number(),
            duration_s: a.number(),
            is_sideways: a.flag(),
            is_clockwise: a.flag(),
        }),
        "loc.send_extpos" => {
            let own = MeasuredPose { position_m: single(a.vector()), quaternion: None };
            localization(own)
        }
        "extpos.send_extpos" => {
            let position_m = [a.number(), a.number(), a.number()];
            localization(MeasuredPose { position_m, quaternion: None })
        }
        "loc.send_extpose" => {
            let position_m = single(a.vector());
            localization(MeasuredPose { position_m, quaternion: Some(single(a.vector())) })
        }
        "platform.send_arming_request" | "supervisor.send_arming_request" => {
            let arms = a.flag();
            Meaning::Arming(if arms { ArmingRequest::Arm } else { ArmingRequest::Disarm })
        }
        "platform.send_crash_recovery_request" | "supervisor.send_crash_recovery_request" => {
            Meaning::Arming(ArmingRequest::Recover)
        }
        "loc.send_emergency_stop" | "supervisor.send_emergency_stop" => Meaning::EmergencyStop,
        "loc.send_emergency_stop_watchdog" | "supervisor.send_emergency_stop_watchdog" => {
            Meaning::EmergencyStopWatchdog
        }
        "platform.send_user_notification" => Meaning::Notification(a.flag()),
        "platform.set_continous_wave"
        | "loc.send_lh_persist_data_packet"
        | "high_level_commander.set_group_mask"
        | "high_level_commander.define_trajectory" => Meaning::Nothing,
        _ => panic!("{path} has no expectation"),
    }
}

/// Height, duration, groups and yaw.
fn vertical(a: &mut Arguments<'_>) -> VerticalFlight {
    let (height_m, duration_s) = (a.number(), a.number());
    a.integer();
    let height = Height::Absolute(height_m);
    VerticalFlight { height, yaw_rad: a.yaw(), pace: Pace::DurationS(duration_s) }
}

fn localization(own: MeasuredPose) -> Meaning {
    Meaning::Localization(Localization { own: Some(own), ..Localization::default() })
}

/// Compares two meanings. A packed quaternion may differ by half a step of its 9 bits, three times
/// that in its largest part, and in the sign of all parts.
pub fn assert_equal(actual: Meaning, mut expected: Meaning, call: &str) {
    if let (
        Meaning::Setpoint(Setpoint::FullState(actual)),
        Meaning::Setpoint(Setpoint::FullState(expected)),
    ) = (&actual, &mut expected)
    {
        let (a, b) = (actual.quaternion, expected.quaternion);
        let length = b.iter().map(|part| part * part).sum::<f32>().sqrt();
        let product: f32 = a.iter().zip(b).map(|(a, b)| a * b).sum();
        let sign = product.signum() / length;
        let error = a.iter().zip(b).map(|(a, b)| (a - b * sign).abs()).fold(0.0, f32::max);
        assert!(error < 3.0 * 0.5 / 511.0, "{call}: {a:?} instead of {b:?}");
        expected.quaternion = a;
    }
    assert_eq!(actual, expected, "{call}");
}
