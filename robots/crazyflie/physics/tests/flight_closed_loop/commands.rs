//! Commands of a whole flight, and their expiry.

use bittybuzz_crazyflie_physics::sensors::SensorFault;
use bittybuzz_flight::planner::{Destination, PlanError, VelocityCommand};
use bittybuzz_flight::stack::{AttitudeCommand, FlightRefusal};
use bittybuzz_flight::supervisor::SupervisorStage;
use bittybuzz_flight::{Reference, Vec3};

use crate::flight_closed_loop::rig::Rig;

/// Waits with signs of life until the motors stop on the ground.
fn wait_for_landing(rig: &mut Rig, seconds: f64) {
    rig.run(seconds, |_| {});
    let state = rig.drone.state();
    let stage = rig.stack.stage();
    // A robot that waits for a script is in preflight.
    let has_landed = matches!(
        stage,
        SupervisorStage::Landed | SupervisorStage::Ready | SupervisorStage::Preflight
    );
    assert!(has_landed, "{stage:?} {state:?}");
    assert!(!rig.drone.has_crashed() && state.position_m.z < 0.02);
    assert_eq!(rig.stack.reference(), None);
}

#[test]
fn a_flight_takes_off_goes_and_lands() {
    for mut rig in [Rig::with_capture(1), Rig::with_deck(1)] {
        let destination =
            Destination::Relative { displacement_m: Vec3::new(0.5, 0.5, 0.2), turn_rad: 1.0 };
        assert_eq!(rig.stack.go_to(destination, None), Err(FlightRefusal::NotFlying));
        assert_eq!(rig.stack.take_off(0.5, None), Err(FlightRefusal::NotArmed));
        rig.take_off(0.5);
        assert_eq!(rig.stack.arm(), Err(FlightRefusal::NotReady));
        let report = rig.stack.go_to(destination, Some(4.0)).expect("refused");
        rig.run(report.duration_s.into(), |_| {});
        rig.stack.hover().expect("refused");
        let state = rig.stack.state();
        assert!(state.position_m.distance(Vec3::new(0.5, 0.5, 0.715)) < 0.05, "{state:?}");
        rig.stack.land(None).expect("refused");
        let again = rig.stack.land(None);
        assert_eq!(again, Err(FlightRefusal::Plan(PlanError::Landing)));
        wait_for_landing(&mut rig, 5.0);
    }
}

/// A long plan ends without signs of life of the script.
#[test]
fn a_silent_script_lands_the_robot() {
    let mut rig = Rig::with_capture(2);
    rig.take_off(0.5);
    let destination = Destination::Relative { displacement_m: Vec3::X, turn_rad: 0.0 };
    rig.stack.go_to(destination, Some(20.0)).expect("refused");
    for _ in 0..600 {
        rig.step();
    }
    assert_eq!(rig.stack.stage(), SupervisorStage::Landing);
    assert_eq!(rig.stack.hover(), Err(FlightRefusal::NotFlying));
    wait_for_landing(&mut rig, 5.0);
}

#[test]
fn a_script_that_fails_lands_the_robot() {
    let mut rig = Rig::with_deck(3);
    rig.take_off(0.5);
    rig.stack.set_script_fault(true);
    wait_for_landing(&mut rig, 5.0);
}

/// A robot that holds an attitude has no plan, yet it lands when the pilot is silent.
#[test]
fn a_pilot_can_fly_and_leave() {
    let mut rig = Rig::with_capture(4);
    rig.arm();
    let climb = AttitudeCommand { climb_m_s: 0.3, ..AttitudeCommand::default() };
    rig.stack.hold(&climb).expect("refused");
    rig.run(2.0, |_| {});
    let turn = AttitudeCommand { yaw_rate_rad_s: 0.5, ..AttitudeCommand::default() };
    rig.stack.hold(&turn).expect("refused");
    rig.run(2.0, |_| {});
    let state = *rig.drone.state();
    assert!((0.3..0.9).contains(&state.position_m.z), "{state:?}");
    assert!((state.rate_rad_s.z - 0.5).abs() < 0.1, "{state:?}");
    for _ in 0..8000 {
        rig.step();
    }
    wait_for_landing(&mut rig, 0.0);
}

#[test]
fn an_emergency_stop_is_final() {
    let mut rig = Rig::with_capture(5);
    rig.take_off(0.3);
    rig.stack.emergency_stop();
    rig.run(0.01, |_| {});
    assert_eq!(rig.stack.stage(), SupervisorStage::Locked);
    assert_eq!(rig.stack.arm(), Err(FlightRefusal::NotReady));
}

#[test]
fn a_velocity_takes_off_and_expires() {
    let mut rig = Rig::with_deck(6);
    rig.arm();
    let up = VelocityCommand { velocity_m_s: Vec3::Z * 0.3, ..VelocityCommand::STOP };
    for millisecond in 0..2500 {
        if millisecond % 10 == 0 {
            rig.stack.fly(&up);
        }
        rig.step();
    }
    assert_eq!(rig.stack.stage(), SupervisorStage::Flying);
    assert!(rig.drone.state().position_m.z > 0.3, "{:?}", rig.drone.state());
    for _ in 0..8000 {
        rig.step();
    }
    wait_for_landing(&mut rig, 0.0);
}

/// Landings of many builds, by command and by the supervisor.
#[test]
fn landings_are_soft() {
    for seed in 1..=20 {
        for (mut rig, is_commanded) in [
            (Rig::with_capture(seed), true),
            (Rig::with_deck(seed), true),
            (Rig::with_capture(seed), false),
            (Rig::with_deck(seed), false),
        ] {
            rig.take_off(0.4);
            if is_commanded {
                rig.stack.land(Some(2.0)).expect("refused");
            } else {
                rig.stack.set_script_fault(true);
            }
            let mut most_g = 0.0_f64;
            rig.run(6.0, |rig| {
                let force = rig.drone.state().specific_force_m_s2.length();
                most_g = most_g.max(force / 9.81);
            });
            wait_for_landing(&mut rig, 0.0);
            // A landing in a room has less than 10 g.
            assert!(most_g < 10.0, "{seed} {is_commanded} {most_g}");
        }
    }
}

/// Without poses the robot stays level; it flies on when they return.
#[test]
fn a_robot_that_finds_its_position_flies_on() {
    let mut rig = Rig::with_capture(7);
    rig.take_off(0.5);
    rig.set_capture_fault(Some(SensorFault::Silent));
    rig.run(0.8, |_| {});
    assert_eq!(rig.stack.stage(), SupervisorStage::LevelOut);
    rig.set_capture_fault(None);
    rig.run(3.0, |_| {});
    assert_eq!(rig.stack.stage(), SupervisorStage::Flying);
    assert!(rig.true_error_m() < 0.03, "{}", rig.true_error_m());
    assert!(rig.drone.state().position_m.z > 0.3, "{:?}", rig.drone.state());
}

#[test]
fn numbers_that_are_not_finite_are_refused() {
    let mut rig = Rig::with_capture(8);
    rig.take_off(0.4);
    let before = rig.stack.reference().expect("no reference");
    let roll_rad = f32::NAN;
    let command = AttitudeCommand { roll_rad, ..AttitudeCommand::default() };
    assert_eq!(rig.stack.hold(&command), Err(FlightRefusal::NotFinite));
    let reference = Reference { yaw_rad: f32::INFINITY, ..before };
    assert_eq!(rig.stack.track(&reference), Err(FlightRefusal::NotFinite));
    let yaw_rad = None;
    let nowhere = Destination::Absolute { position_m: Vec3::NAN, yaw_rad };
    let refusal = Err(FlightRefusal::Plan(PlanError::NotFinite));
    assert_eq!(rig.stack.go_to(nowhere, None), refusal);
    rig.run(0.1, |_| {});
    assert_eq!(rig.reference_m(), before.position_m.as_dvec3());
}

/// A table below the robot is higher than the ground from which it took off.
#[test]
fn a_landing_on_a_table_ends() {
    let mut rig = Rig::with_capture(9);
    rig.take_off(0.6);
    rig.surroundings.ground_m = 0.3;
    // A shorter landing would hit the table like a crash.
    rig.stack.land(Some(10.0)).expect("refused");
    rig.run(20.0, |_| {});
    assert!(!rig.drone.has_crashed());
    let stage = rig.stack.stage();
    assert!(matches!(stage, SupervisorStage::Landed | SupervisorStage::Ready), "{stage:?}");
    assert_eq!(rig.drone.state().rotor_rpm, [0.0; 4]);
}

/// A robot whose start is not where the flight controller expects it.
#[test]
fn a_displaced_robot_adopts_the_measured_position() {
    let mut rig = Rig::with_capture(10);
    rig.drone.stand(0.0, 2.0, -1.0, 1.0);
    rig.run(2.0, |_| {});
    rig.take_off(0.5);
    assert!(rig.true_error_m() < 0.02, "{}", rig.true_error_m());
    let height_m = rig.drone.state().position_m.z;
    assert!((height_m - 0.515).abs() < 0.01, "{height_m}");
}
