//! Landings of a robot with a Flow deck on a floor that is not the one of its take-off.

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

/// A robot that is switched on stands where it is told, on whatever.
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
