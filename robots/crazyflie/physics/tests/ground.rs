//! Landing, rest and crashes.

use bittybuzz_crazyflie_physics::{
    Airframe, CrashCause, DQuat, DVec3, Drone, DroneState, DroneSurroundings, GRAVITY_M_S2, Impact,
};

const PLUS: Airframe = Airframe::CRAZYFLIE_2_1_PLUS;

/// Drops a robot onto the ground at 0 m and returns it after `seconds`, with its first impact.
fn dropped(start: DroneState, seconds: u32) -> (Drone, Option<Impact>) {
    let mut drone = Drone::nominal(PLUS);
    drone.set_state(start);
    let mut first = None;
    for _ in 0..1000 * seconds {
        let impact = drone.step([0.0; 4], &DroneSurroundings::default());
        first = first.or(impact);
    }
    (drone, first)
}

fn at_height(feet_m: f64) -> DroneState {
    DroneState::at_rest(DVec3::new(0.0, 0.0, feet_m + PLUS.feet_below_m), 0.7)
}

fn assert_rests(drone: &Drone) {
    let state = drone.state();
    assert!(state.velocity_m_s.length() < 1e-6, "{state:?}");
    assert!(state.rate_rad_s.length() < 1e-5, "{state:?}");
    assert!((state.specific_force_m_s2.length() - GRAVITY_M_S2).abs() < 1e-3);
    assert!(drone.contact().is_touching());
}

#[test]
fn a_standing_robot_does_not_move() {
    let mut drone = Drone::nominal(PLUS);
    drone.stand(0.5, 1.0, -2.0, 0.3);
    let before = *drone.state();
    let surroundings = DroneSurroundings { ground_m: 0.5, ..DroneSurroundings::default() };
    for _ in 0..10_000 {
        assert_eq!(drone.step([0.0; 4], &surroundings), None);
        assert!((drone.state().specific_force_m_s2.z - GRAVITY_M_S2).abs() < 1e-6);
    }
    assert!((drone.state().position_m - before.position_m).length() < 1e-9);
    assert_rests(&drone);
    assert!(!drone.has_crashed());
}

#[test]
fn a_slow_drop_is_a_landing() {
    let (drone, impact) = dropped(at_height(0.03), 2);
    assert_rests(&drone);
    assert!(!drone.has_crashed(), "{:?}", drone.contact());
    let speed = (2.0 * GRAVITY_M_S2 * 0.03_f64).sqrt();
    let impact = impact.expect("an impact");
    assert!((impact.speed_m_s - speed).abs() < 0.02 && impact.tilt_rad < 1e-6, "{impact:?}");
}

#[test]
fn a_fast_drop_is_a_crash() {
    let (drone, impact) = dropped(at_height(0.5), 3);
    assert_rests(&drone);
    assert_eq!(drone.contact().crash(), Some(CrashCause::Speed));
    let speed = (2.0 * GRAVITY_M_S2 * 0.5_f64).sqrt();
    // Drag takes some percent.
    assert!((impact.expect("an impact").speed_m_s / speed - 1.0).abs() < 0.1);
}

#[test]
fn a_robot_upside_down_touches_with_propellers() {
    let attitude = DQuat::from_xyzw(1.0, 0.0, 0.0, 0.0);
    let (drone, _) = dropped(DroneState { attitude, ..at_height(0.02) }, 4);
    assert_eq!(drone.contact().crash(), Some(CrashCause::Propeller));
    assert_rests(&drone);
    assert!(drone.state().tilt_rad() > 3.0);
}

#[test]
fn a_tilted_touch_is_a_crash() {
    let attitude = DQuat::from_rotation_x(0.7);
    let (drone, impact) = dropped(DroneState { attitude, ..at_height(0.04) }, 3);
    assert_eq!(drone.contact().crash(), Some(CrashCause::Tilt));
    assert!((impact.expect("an impact").tilt_rad - 0.7).abs() < 0.05);
    assert_rests(&drone);
}

/// Every drop ends at rest, whatever the attitude, velocity and rate.
#[test]
fn every_drop_comes_to_rest() {
    for case in 0..40 {
        let part = |step: f64| (f64::from(case) * step).sin();
        let axis = DVec3::new(part(1.3), part(2.1), part(3.7) + 1e-3).normalize();
        let start = DroneState {
            attitude: DQuat::from_axis_angle(axis, 3.0 * part(0.9)),
            velocity_m_s: DVec3::new(3.0 * part(1.1), 2.0 * part(5.3), 3.0 * part(0.7)),
            rate_rad_s: DVec3::new(part(4.1), part(0.3), part(6.1)) * 20.0,
            ..at_height(0.2)
        };
        let (drone, _) = dropped(start, 8);
        let state = drone.state();
        assert!(state.velocity_m_s.length() < 1e-3, "{case}: {state:?}");
        assert!(state.rate_rad_s.length() < 1e-2, "{case}: {state:?}");
        assert!(state.position_m.z > 0.0 && state.position_m.z < 0.06, "{case}: {state:?}");
    }
}

/// Contact never adds energy while the feet slide and bounce.
#[test]
fn contact_takes_energy() {
    let start = DroneState { velocity_m_s: DVec3::new(1.0, 0.5, 0.0), ..at_height(0.02) };
    let mut drone = Drone::nominal(PLUS);
    drone.set_state(start);
    let energy = |state: &DroneState| {
        PLUS.mass_kg
            * (state.velocity_m_s.length_squared() / 2.0 + GRAVITY_M_S2 * state.position_m.z)
            + state.rate_rad_s.dot(PLUS.inertia_kg_m2 * state.rate_rad_s) / 2.0
    };
    let first = energy(&start);
    for _ in 0..2000 {
        drone.step([0.0; 4], &DroneSurroundings::default());
        assert!(energy(drone.state()) < first * 1.000_001);
    }
    // Friction stops it: about v² / (2 μ g) = 0.1 m from the touch.
    assert_rests(&drone);
    let way = drone.state().position_m.truncate().length();
    assert!((0.08..0.35).contains(&way), "{way}");
}

#[test]
fn a_gentle_push_below_friction_does_not_creep() {
    let mut drone = Drone::nominal(PLUS);
    let push = DVec3::new(0.1, 0.0, 0.0);
    let pushed = DroneSurroundings { external_force_n: push, ..DroneSurroundings::default() };
    for _ in 0..10_000 {
        drone.step([0.0; 4], &pushed);
    }
    let early = drone.state().position_m;
    for _ in 0..10_000 {
        drone.step([0.0; 4], &pushed);
    }
    assert!((drone.state().position_m - early).length() < 1e-9);
    assert!(early.x < 5e-4);
}

#[test]
fn take_off_leaves_the_ground() {
    let mut drone = Drone::nominal(PLUS);
    for _ in 0..1000 {
        drone.step([0.8; 4], &DroneSurroundings::default());
    }
    assert!(drone.state().position_m.z > 0.1 && !drone.has_crashed());
    assert!(!drone.contact().is_touching());
}

/// A robot at rest moves again with its motors, a push or another ground.
#[test]
fn rest_ends_with_any_cause() {
    let calm = DroneSurroundings::default();
    let resting = || {
        let (drone, _) = dropped(at_height(0.01), 2);
        assert_eq!(drone.state().velocity_m_s, DVec3::ZERO);
        drone
    };
    let mut pushed = resting();
    let push = DVec3::new(0.5, 0.0, 0.0);
    let mut lowered = resting();
    let mut started = resting();
    for _ in 0..300 {
        pushed.step([0.0; 4], &DroneSurroundings { external_force_n: push, ..calm });
        lowered.step([0.0; 4], &DroneSurroundings { ground_m: -0.1, ..calm });
        started.step([0.9; 4], &calm);
    }
    assert!(pushed.state().position_m.x > 0.1, "{:?}", pushed.state());
    assert!(lowered.state().position_m.z < -0.05);
    assert!(started.state().position_m.z > 0.02);
    assert_eq!(pushed.state().steps, 2300);
}
