//! The image's flights under disturbances.

use bittybuzz_hil::{BodySensor, Command, MeasurementFault, PoseErrors, Robot, Room};

use super::course::{Course, attach_flow_deck};
use super::disturbance::{
    DisturbanceKind, Effects, FLIGHT_MS, GUSTS, HEIGHT_M, PositionSource, Scenario,
};
use super::fresh::{numbers, print_count, print_worst};

/// Legs that a robot flies in the time of a flight at most.
const LEGS: usize = 6;
/// Time in ms between two looks at the effects. A touch lasts as long.
const EFFECT_MS: u64 = 10;
/// Mass of a Crazyflie 2.1+ in kg, as of the physics.
const MASS_KG: f64 = bittybuzz_crazyflie_physics::Airframe::CRAZYFLIE_2_1_PLUS.mass_kg;
/// Noise of the flow sensor of the physics in counts.
const FLOW_COUNTS: f64 = bittybuzz_crazyflie_physics::sensors::FlowSettings::PMW3901.sigma_counts;
/// The limits of the host's flights.
const ERROR_M_MAX: f64 = 0.3;
const GUST_ERROR_M_MAX: f64 = 0.4;

/// A robot in the room of `Rig`: poses of 1 mm noise 100 times per second, or a Flow deck.
fn body(scenario: &Scenario) -> Command {
    let pose_ms = if scenario.source == PositionSource::MotionCapture { 10 } else { 0 };
    Command::Body {
        seed: scenario.seed,
        x_mm: 0.0,
        y_mm: 0.0,
        yaw_degrees: 0.0,
        pose_ms,
        pose_noise_mm: 1.0,
        pose_noise_degrees: 0.005_f64.to_degrees(),
    }
}

/// Returns the sensor whose noise differs from its usual one, and the factor.
fn noise(scenario: &Scenario) -> Option<(BodySensor, f64)> {
    match scenario.kind {
        DisturbanceKind::PoseNoise => Some((BodySensor::Poses, scenario.strength)),
        DisturbanceKind::RangeNoise => Some((BodySensor::Distance, scenario.strength)),
        DisturbanceKind::QuietFlow => Some((BodySensor::Flow, scenario.strength / FLOW_COUNTS)),
        _ => None,
    }
}

/// Lets act what acts from the ground on.
fn begin(robot: &mut Robot, scenario: &Scenario) {
    robot.execute(&body(scenario));
    if let Some((sensor, factor)) = noise(scenario) {
        let fault = Some(MeasurementFault::Noisy(factor));
        robot.execute(&Command::BodyFault { sensor, fault });
    }
    if scenario.kind == DisturbanceKind::Gusts {
        let (gusts_m_s, gust_s) = GUSTS;
        let wind_m_s = scenario.along(scenario.strength).to_array();
        let (seed, calm) = (scenario.seed, Room::default());
        robot.execute(&Command::Room(Room { wind_m_s, gusts_m_s, gust_s, seed, ..calm }));
    }
}

/// Lets these effects act.
fn disturb(robot: &mut Robot, effects: &Effects, before: &Effects) {
    let room = |effects: &Effects| Room {
        force_n: (effects.acceleration_m_s2 * MASS_KG).to_array(),
        floor_mm: effects.floor_m * 1000.0,
        ..Room::default()
    };
    let errors = |effects: &Effects| PoseErrors {
        latency_ms: effects.latency_s.map_or(10, |seconds| (seconds * 1000.0) as u32),
        jump_mm: (effects.jump_m * 1000.0).to_array(),
        turn_degrees: effects.frame_turn_rad.to_degrees(),
        marker_turn_degrees: effects.marker_turn_rad.to_array().map(f64::to_degrees),
        ..PoseErrors::default()
    };
    if room(effects) != room(before) {
        robot.execute(&Command::Room(room(effects)));
    }
    if errors(effects) != errors(before) {
        robot.execute(&Command::PoseErrors(errors(effects)));
    }
}

/// What was observed.
struct Observations {
    early_end: Option<String>,
    worst_m: f64,
    drift_m: f64,
}

/// Flies a scenario.
fn fly(scenario: &Scenario) -> Observations {
    let mut legs = scenario.clone();
    let goals_m: Vec<[f32; 2]> = (0..LEGS).map(|_| legs.next_goal_m()).collect();
    let course = Course {
        height_mm: (HEIGHT_M * 1000.0) as u32,
        goals_mm: goals_m.iter().map(|goal| goal.map(|m| m * 1000.0)).collect(),
    };
    let mut flight = course.take_off(|robot| {
        if scenario.source == PositionSource::FlowDeck {
            attach_flow_deck(robot);
        }
        begin(robot, scenario);
    });
    let mut before = Effects::default();
    for ms in (0..FLIGHT_MS).step_by(EFFECT_MS as usize) {
        let effects = scenario.effects(ms);
        disturb(&mut flight.robot, &effects, &before);
        before = effects;
        flight.robot.run_ms(EFFECT_MS);
    }
    let Effects { frame_turn_rad, jump_m, .. } = before;
    let (sin, cos) = frame_turn_rad.sin_cos();
    let seen = |[x, y, z]: [f64; 3]| {
        let [dx, dy, dz] = jump_m.to_array();
        [cos * x - sin * y + dx, sin * x + cos * y + dy, z + dz]
    };
    let has_poses = scenario.source == PositionSource::MotionCapture;
    let errors = flight.errors(&course, has_poses.then_some(&seen));
    let worst_m = errors.distances_m.iter().copied().fold(0.0, f64::max);
    Observations { early_end: flight.early_end(), worst_m, drift_m: errors.drift_m }
}

/// Flies the scenarios of these numbers, and asserts their limits at the end.
fn fly_all(numbers: std::ops::Range<usize>) {
    let mut all = Vec::new();
    let mut broken = Vec::new();
    for number in numbers {
        let scenario = Scenario::new(number);
        let found = fly(&scenario);
        let error_mm = found.worst_m * 1e3;
        println!(
            "flight {number}, {:?} with {:?}, {:.2}: {error_mm:.0} mm of error, {:.0} mm of drift, {}",
            scenario.kind,
            scenario.source,
            scenario.strength,
            found.drift_m * 1e3,
            found.early_end.as_deref().unwrap_or("complete")
        );
        let is_gusts = scenario.kind == DisturbanceKind::Gusts;
        let most_m = if is_gusts { GUST_ERROR_M_MAX } else { ERROR_M_MAX };
        if found.early_end.is_some() || found.worst_m > most_m {
            broken.push(number);
        }
        all.push((scenario, found));
    }
    let kinds: std::collections::BTreeSet<String> =
        all.iter().map(|(scenario, _)| name(scenario)).collect();
    for kind in kinds {
        let of_kind = || all.iter().filter(|(scenario, _)| name(scenario) == kind);
        let values = of_kind()
            .map(|(scenario, found)| (scenario.number, Some((found.worst_m * 1e3).round())));
        print_worst(&format!("mm of error, {kind}"), values);
        print_count(&format!("flights, {kind}"), of_kind().count());
        let sum_mm = of_kind().map(|(_, found)| (found.worst_m * 1e3).round() as usize).sum();
        print_count(&format!("sum of mm of error, {kind}"), sum_mm);
    }
    print_count("end early", all.iter().filter(|(_, found)| found.early_end.is_some()).count());
    assert!(broken.is_empty(), "{broken:?}");
}

fn name(scenario: &Scenario) -> String {
    format!("{:?} with {:?}", scenario.kind, scenario.source)
}

/// A flight in gusts from the ground on.
#[test]
fn the_image_flies_in_gusts() {
    fly_all(30_010..30_011);
}

#[test]
#[ignore = "`cargo xtask soak image_flights` runs it"]
fn fresh_flights_under_disturbances() {
    fly_all(numbers());
}
