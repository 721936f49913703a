//! The robot file states the functions, durations and limits of the pilot to authors of scripts.

use bittybuzz_flight::pilot::{ARRIVAL_MS, PilotFunction, PilotSettings, SPIN_MS};
use bittybuzz_robot_spec::{Robot, RobotFunction};

use super::*;

fn robot() -> Robot {
    bittybuzz_robot_files::find("crazyflie").expect("the robot is shipped")
}

fn function(robot: &Robot, name: &str) -> RobotFunction {
    let found = robot.functions.iter().find(|function| function.name == name);
    found.unwrap_or_else(|| panic!("the robot file has no `{name}`")).clone()
}

/// The robot returns and waits as the pilot does.
#[test]
fn the_robot_file_has_the_pilots_functions() {
    let robot = robot();
    for (name, pilot) in PilotFunction::ALL {
        let function = function(&robot, name);
        assert_eq!(function.returns.is_some(), pilot.has_value(), "{name}");
        let waits = matches!(
            pilot,
            PilotFunction::TakeOff
                | PilotFunction::Land
                | PilotFunction::Spin
                | PilotFunction::GoTo
        );
        assert_eq!(function.waits, waits, "{name}");
        assert!(CrazyflieModel::STANDARD.effect(&function).is_some(), "{name}");
    }
}

#[test]
fn the_robot_file_states_the_pilots_numbers() {
    let robot = robot();
    let settings = PilotSettings::CRAZYFLIE;
    let model = CrazyflieModel::STANDARD.pilot();
    assert_eq!(model.limits.speed_m_s, settings.limits.speed_m_s);
    let mm = |m: f32| (m * 1000.0).round();
    let climb = format!("up to {} mm/s", mm(settings.limits.climb_m_s));
    for (name, texts) in [
        ("takeoff", vec![climb.clone(), format!("{} mV", settings.battery_low_mv)]),
        ("land", vec![climb]),
        (
            "spin",
            vec![
                format!("for {} s", SPIN_MS as f64 / 1000.0),
                format!("up to {},", settings.limits.yaw_rate_rad_s.to_degrees().floor()),
            ],
        ),
        (
            "goTo",
            vec![
                format!("up to {} mm/s", mm(settings.limits.speed_m_s)),
                format!("{} s after", ARRIVAL_MS / 1000),
            ],
        ),
        (
            "goto",
            vec![
                format!("up to {} mm/s", mm(settings.approach_m_s)),
                format!("within {} mm", mm(settings.arrival_m)),
            ],
        ),
        ("forward", vec![format!("at {} mm/s", mm(settings.cruise_m_s))]),
        ("left", vec![format!("at {} degrees", settings.turn_rad_s.to_degrees().round())]),
        ("right", vec![format!("at {} degrees", settings.turn_rad_s.to_degrees().round())]),
    ] {
        let help = function(&robot, name).help;
        for text in texts {
            assert!(help.contains(&text), "the help of `{name}` lacks \"{text}\": {help}");
        }
    }
}

/// The pilot and the physics stand on the same feet.
#[test]
fn the_pilot_knows_the_height_of_a_standing_robot() {
    let feet_m = bittybuzz_crazyflie_physics::Airframe::CRAZYFLIE_2_1_PLUS.feet_below_m;
    assert_eq!(PilotSettings::CRAZYFLIE.standing_m, feet_m as f32);
}
