//! One flight under a disturbance, and what was observed.

use bittybuzz_crazyflie_physics::sensors::SensorFault;
use bittybuzz_crazyflie_physics::{DQuat, DVec3, Wind, WindSettings};
use bittybuzz_flight::Vec3;
use bittybuzz_flight::planner::Destination;
use bittybuzz_flight::supervisor::SupervisorStage;

use crate::disturbances::disturbance::{DisturbanceKind, PositionSource, Scenario};
use crate::flight_closed_loop::consistency::nees_of;
use crate::flight_closed_loop::rig::Rig;

/// Height of the flight above the first floor in m.
const HEIGHT_M: f32 = 0.8;
/// Time in ms of the disturbed flight.
const FLIGHT_MS: u64 = 15_000;
/// Time in ms between two legs, and the duration of a leg in seconds.
const LEG_MS: u64 = 2500;
const LEG_S: f32 = 2.0;
/// Time in ms after the last step of the floor from which the height has to be right.
const STEP_SETTLED_MS: u64 = 3000;
/// Noise of flow in counts that the flight controller assumes, and that of the other flights.
const ASSUMED_COUNTS: f64 = 2.0;
/// Age of poses in seconds that the flight controller assumes if they come late.
const ASSUMED_AGE_S: f64 = 0.01;
/// Slow and quick change of the latency, as a share of its mean, and their periods in ms.
const LATENCY_SWAYS: [(f64, f64); 2] = [(0.3, 7000.0), (0.1, 230.0)];
/// Time in ms from which the sensors' new frame counts for the consistency of the estimate.
const SETTLED_MS: u64 = 1000;
/// Duration of a touch in ms.
const BUMP_MS: u64 = 10;

/// Observations of a flight.
#[derive(Clone, Debug, Default)]
pub struct Observations {
    /// Time in ms at which the flight ended early, with the stage then.
    pub lost: Option<(u64, SupervisorStage)>,
    /// Largest distance in m from the reference: of the true place in the sensors' frame with motion
    /// capture, of the estimate with a deck, whose position drifts.
    pub worst_m: f64,
    /// Horizontal growth in m of the error of the estimate.
    pub drift_m: f64,
    /// Largest error in m of the height above the floor, once the last step is 3 s ago.
    pub height_error_m: f64,
    /// Mean NEES of nine states in the sensors' frame.
    pub nees: f64,
}

/// Builds the robot of a scenario, with what acts from the ground on.
fn build(scenario: &Scenario) -> Rig {
    let seed = scenario.seed;
    let mut rig = match (scenario.source, scenario.kind) {
        (PositionSource::MotionCapture, _) => Rig::with_capture(seed),
        (_, DisturbanceKind::QuietFlow) => {
            let assumed_counts =
                if scenario.states_noise { scenario.strength } else { ASSUMED_COUNTS };
            Rig::with_assumed_flow_noise(seed, scenario.strength, assumed_counts)
        }
        _ => Rig::with_deck(seed),
    };
    let noise = SensorFault::Noisy(scenario.strength);
    match scenario.kind {
        DisturbanceKind::PoseNoise => rig.set_capture_fault(Some(noise)),
        DisturbanceKind::RangeNoise => rig.set_range_fault(Some(noise)),
        _ => {}
    }
    if scenario.kind == DisturbanceKind::Gusts {
        let mean_m_s = scenario.along(scenario.strength);
        let settings = WindSettings { mean_m_s, gust_sigma_m_s: 1.0, gust_s: 0.8 };
        rig.wind = Some(Wind::new(settings, seed));
    }
    rig
}

/// Returns the change of the sensors' frame that the scenario makes: a turn and then an offset.
fn frame(scenario: &Scenario) -> (DQuat, DVec3) {
    match scenario.kind {
        DisturbanceKind::FrameTurn => (DQuat::from_rotation_z(scenario.strength), DVec3::ZERO),
        DisturbanceKind::PoseJump => (DQuat::IDENTITY, scenario.along(scenario.strength)),
        _ => (DQuat::IDENTITY, DVec3::ZERO),
    }
}

/// Returns the turn of the markers on the robot that the scenario makes.
fn marker_turn(scenario: &Scenario) -> DQuat {
    match scenario.kind {
        DisturbanceKind::MarkerTurn => {
            DQuat::from_axis_angle(scenario.along(1.0), scenario.strength)
        }
        _ => DQuat::IDENTITY,
    }
}

/// Lets the disturbance act in this millisecond of the flight.
fn disturb(rig: &mut Rig, scenario: &Scenario, ms: u64) {
    let mass_kg = rig.drone.airframe().mass_kg;
    match scenario.kind {
        DisturbanceKind::SideForce => {
            rig.surroundings.external_force_n = scenario.along(scenario.strength * mass_kg);
        }
        DisturbanceKind::Bump => {
            let acceleration_m_s2 = scenario.strength / (BUMP_MS as f64 * 1e-3);
            let turned = DQuat::from_rotation_z((ms / LEG_MS) as f64);
            let force_n = turned * scenario.along(acceleration_m_s2 * mass_kg);
            let acts = ms % LEG_MS < BUMP_MS;
            rig.surroundings.external_force_n = if acts { force_n } else { DVec3::ZERO };
        }
        DisturbanceKind::PoseJump | DisturbanceKind::FrameTurn => {
            let (turn, jump_m) = frame(scenario);
            if let Some(capture) = rig.capture() {
                capture.set_turn(turn);
                capture.set_jump_m(jump_m);
            }
        }
        DisturbanceKind::MarkerTurn => {
            if let Some(capture) = rig.capture() {
                capture.set_marker_turn(marker_turn(scenario));
            }
        }
        DisturbanceKind::Latency => {
            rig.assumed_age_s = Some(ASSUMED_AGE_S);
            let sway = |(share, period_ms): (f64, f64)| {
                share * (ms as f64 / period_ms * core::f64::consts::TAU).sin()
            };
            let factor = 1.0 + LATENCY_SWAYS.into_iter().map(sway).sum::<f64>();
            let steps = scenario.strength * factor / bittybuzz_crazyflie_physics::STEP_S;
            if let Some(capture) = rig.capture() {
                capture.set_latency_steps(steps as u32);
            }
        }
        DisturbanceKind::FloorStep => {
            // Up first: the robot flies over a mat or a table, and leaves it.
            let is_up = (ms / LEG_MS).is_multiple_of(2);
            let sign = if scenario.course_rad < core::f64::consts::PI { 1.0 } else { -1.0 };
            rig.surroundings.ground_m = if is_up { sign * scenario.strength } else { 0.0 };
        }
        DisturbanceKind::Calm
        | DisturbanceKind::Gusts
        | DisturbanceKind::QuietFlow
        | DisturbanceKind::PoseNoise
        | DisturbanceKind::RangeNoise => {}
    }
}

/// Flies a scenario to its end.
pub fn fly(scenario: &Scenario) -> Observations {
    let mut found = Observations::default();
    let mut path = scenario.path.clone();
    let mut rig = build(scenario);
    rig.arm();
    rig.stack.take_off(HEIGHT_M, Some(2.0)).expect("no take-off");
    rig.run(4.0, |_| {});
    let (turn, jump_m) = frame(scenario);
    let start = rig.estimate_error_m().truncate();
    let (mut nees, mut samples) = (0.0, 0.0);
    for ms in 0..FLIGHT_MS {
        if ms % LEG_MS == 0 {
            // Legs out and back, so that the drift does not depend on the distance to the start.
            let course = path.unit_f32() * core::f32::consts::TAU;
            let length_m = 0.3 + 0.7 * path.unit_f32();
            let (sin, cos) = course.sin_cos();
            let position_m = Vec3::new(cos * length_m, sin * length_m, HEIGHT_M);
            let destination = Destination::Absolute { position_m, yaw_rad: None };
            let _ = rig.stack.go_to(destination, Some(LEG_S));
        }
        // A step of the floor lasts to the end from the last leg but one on.
        let is_step = scenario.kind == DisturbanceKind::FloorStep;
        let last_step_ms = FLIGHT_MS - 2 * LEG_MS;
        disturb(&mut rig, scenario, if is_step { ms.min(last_step_ms) } else { ms });
        rig.run(0.001, |_| {});
        let stage = rig.stack.stage();
        if stage != SupervisorStage::Flying {
            found.lost = Some((ms, stage));
            break;
        }
        let Some(reference) = rig.stack.reference() else { continue };
        let reference_m = reference.position_m.as_dvec3();
        let truth = *rig.drone.state();
        let error_m = match scenario.source {
            PositionSource::MotionCapture => {
                (turn * truth.position_m + jump_m).distance(reference_m)
            }
            PositionSource::FlowDeck => rig.own_error_m(),
        };
        found.worst_m = found.worst_m.max(error_m);
        if ms >= last_step_ms + STEP_SETTLED_MS || !is_step {
            let estimated_m = f64::from(rig.stack.height_above_floor_m());
            let true_m = truth.position_m.z - rig.surroundings.ground_m;
            found.height_error_m = found.height_error_m.max((estimated_m - true_m).abs());
        }
        let changed_ms = if is_step { ms % LEG_MS } else { ms };
        if ms % 250 == 0 && changed_ms >= SETTLED_MS {
            let floor_m = f64::from(rig.stack.floor_m()) - rig.surroundings.ground_m;
            let offset_m = match scenario.source {
                PositionSource::MotionCapture => jump_m,
                // A deck gives heights above the floor.
                PositionSource::FlowDeck => DVec3::Z * floor_m,
            };
            nees += nees_of(&rig, turn, marker_turn(scenario), offset_m)[0];
            samples += 1.0;
        }
    }
    found.nees = nees / f64::max(samples, 1.0);
    found.drift_m = (rig.estimate_error_m().truncate() - start).length();
    found
}
