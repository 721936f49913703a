//! One flight under a disturbance, and what was observed.

use bittybuzz_crazyflie_physics::sensors::SensorFault;
use bittybuzz_crazyflie_physics::{DQuat, DVec3, Wind, WindSettings};
use bittybuzz_flight::Vec3;
use bittybuzz_flight::planner::Destination;
use bittybuzz_flight::supervisor::SupervisorStage;

use crate::disturbances::disturbance::{
    DisturbanceKind, Effects, FLIGHT_MS, GUSTS, HEIGHT_M, LAST_STEP_MS, LEG_MS, PositionSource,
    Scenario,
};
use crate::flight_closed_loop::consistency::nees_of;
use crate::flight_closed_loop::rig::Rig;

/// Duration of a leg in seconds.
const LEG_S: f32 = 2.0;
/// Time in ms after the last step of the floor from which the height has to be right.
const STEP_SETTLED_MS: u64 = 3000;
/// Noise of flow in counts that the flight controller assumes, and that of the other flights.
const ASSUMED_COUNTS: f64 = 2.0;
/// Age of poses in seconds that the flight controller assumes if they come late.
const ASSUMED_AGE_S: f64 = 0.01;
/// Time in ms from which the sensors' new frame counts for the consistency of the estimate.
const SETTLED_MS: u64 = 1000;

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
        let (gust_sigma_m_s, gust_s) = GUSTS;
        let settings = WindSettings { mean_m_s, gust_sigma_m_s, gust_s };
        rig.wind = Some(Wind::new(settings, seed));
    }
    rig
}

/// Lets these effects act.
fn disturb(rig: &mut Rig, effects: &Effects) {
    let mass_kg = rig.drone.airframe().mass_kg;
    rig.surroundings.external_force_n = effects.acceleration_m_s2 * mass_kg;
    rig.surroundings.ground_m = effects.floor_m;
    if effects.latency_s.is_some() {
        rig.assumed_age_s = Some(ASSUMED_AGE_S);
    }
    let Some(capture) = rig.capture() else { return };
    capture.set_turn(DQuat::from_rotation_z(effects.frame_turn_rad));
    capture.set_jump_m(effects.jump_m);
    capture.set_marker_turn(DQuat::from_scaled_axis(effects.marker_turn_rad));
    if let Some(latency_s) = effects.latency_s {
        capture.set_latency_steps((latency_s / bittybuzz_crazyflie_physics::STEP_S) as u32);
    }
}

/// Flies a scenario to its end.
pub fn fly(scenario: &Scenario) -> Observations {
    let mut found = Observations::default();
    let mut legs = scenario.clone();
    let mut rig = build(scenario);
    rig.arm();
    rig.stack.take_off(HEIGHT_M, Some(2.0)).expect("no take-off");
    rig.run(4.0, |_| {});
    let lasting = scenario.effects(FLIGHT_MS);
    let (turn, jump_m) = (DQuat::from_rotation_z(lasting.frame_turn_rad), lasting.jump_m);
    let marker_turn = DQuat::from_scaled_axis(lasting.marker_turn_rad);
    let start = rig.estimate_error_m().truncate();
    let (mut nees, mut samples) = (0.0, 0.0);
    for ms in 0..FLIGHT_MS {
        if ms % LEG_MS == 0 {
            let [x, y] = legs.next_goal_m();
            let position_m = Vec3::new(x, y, HEIGHT_M);
            let destination = Destination::Absolute { position_m, yaw_rad: None };
            let _ = rig.stack.go_to(destination, Some(LEG_S));
        }
        let is_step = scenario.kind == DisturbanceKind::FloorStep;
        disturb(&mut rig, &scenario.effects(ms));
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
        if ms >= LAST_STEP_MS + STEP_SETTLED_MS || !is_step {
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
            nees += nees_of(&rig, turn, marker_turn, offset_m)[0];
            samples += 1.0;
        }
    }
    found.nees = nees / f64::max(samples, 1.0);
    found.drift_m = (rig.estimate_error_m().truncate() - start).length();
    found
}
