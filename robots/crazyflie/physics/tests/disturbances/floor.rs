//! Floors below a robot with a Flow deck: higher or lower than the one of its take-off, or without
//! features.

use bittybuzz_crazyflie_physics::sensors::FloorSurface;
use bittybuzz_flight::Vec3;
use bittybuzz_flight::planner::Destination;
use bittybuzz_flight::supervisor::SupervisorStage;

use crate::flight_closed_loop::rig::Rig;

/// Lands, and checks that the robot touched down softly on a floor of this height.
fn land(rig: &mut Rig, floor_m: f64) {
    rig.stack.land(None).expect("refused");
    rig.run(8.0, |_| {});
    let state = rig.drone.state();
    let stage = rig.stack.stage();
    assert!(!rig.drone.has_crashed(), "{floor_m}: {state:?}");
    assert!((state.position_m.z - floor_m - 0.015).abs() < 0.005, "{floor_m}: {state:?}");
    assert!(matches!(stage, SupervisorStage::Landed | SupervisorStage::Ready), "{stage:?}");
    assert_eq!(state.rotor_rpm, [0.0; 4]);
}

#[test]
fn a_robot_lands_on_a_table_and_returns_to_the_floor() {
    for seed in 1..=10 {
        for table_m in [0.05, 0.3, 0.5] {
            let mut rig = Rig::with_deck(seed);
            rig.take_off(0.8);
            rig.surroundings.ground_m = table_m;
            rig.run(1.0, |_| {});
            let height_m = f64::from(rig.stack.height_above_floor_m());
            assert!((height_m - (rig.drone.state().position_m.z - table_m)).abs() < 0.02);
            land(&mut rig, table_m);
            rig.take_off(0.4);
            rig.surroundings.ground_m = 0.0;
            rig.run(1.0, |_| {});
            land(&mut rig, 0.0);
        }
    }
}

/// A robot that is switched on stands at the assumed place, on any surface.
#[test]
fn a_robot_takes_off_from_a_table() {
    for seed in 1..=10 {
        let mut rig = Rig::with_deck(seed);
        rig.surroundings.ground_m = 0.4;
        rig.drone.stand(0.4, 0.0, 0.0, 0.0);
        let state = *rig.drone.state();
        rig.stack.adopt(&bittybuzz_flight::FlightState {
            position_m: state.position_m.as_vec3(),
            ..bittybuzz_flight::FlightState::default()
        });
        rig.take_off(0.5);
        let height_m = rig.drone.state().position_m.z;
        assert!((height_m - 0.915).abs() < 0.03, "{height_m}");
        rig.surroundings.ground_m = 0.0;
        rig.run(1.0, |_| {});
        land(&mut rig, 0.0);
    }
}

/// A robot at 0.5 m/s comes above a floor whose motion the flow sensor sees to a fifth. If it trusted
/// the counts, it would fly five times as fast.
#[test]
fn a_floor_without_features_ends_the_flight() {
    for seed in 1..=10 {
        let mut rig = Rig::with_deck(seed);
        rig.take_off(0.8);
        let destination = Destination::Relative { displacement_m: Vec3::X * 2.0, turn_rad: 0.0 };
        rig.stack.go_to(destination, Some(4.0)).expect("refused");
        rig.run(1.5, |_| {});
        rig.set_surface(FloorSurface::FEATURELESS);
        let mut fastest_m_s = 0.0_f64;
        rig.run(0.6, |rig| {
            fastest_m_s = fastest_m_s.max(rig.drone.state().velocity_m_s.truncate().length());
        });
        assert_eq!(rig.stack.stage(), SupervisorStage::LevelOut);
        rig.run(6.0, |rig| {
            fastest_m_s = fastest_m_s.max(rig.drone.state().velocity_m_s.truncate().length());
        });
        assert!(!rig.drone.has_crashed() && rig.drone.state().position_m.z < 0.02);
        // A move of 2 m in 4 s has 1.1 m/s at most.
        assert!(fastest_m_s < 1.3, "{fastest_m_s}");
    }
}
