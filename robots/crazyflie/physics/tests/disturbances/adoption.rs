//! Poses that are displaced in flight: adopted, or the end of the flight; and positions without
//! attitude, and old ones.

use bittybuzz_crazyflie_physics::DVec3;
use bittybuzz_flight::Vec3;
use bittybuzz_flight::avoidance::PeerReport;
use bittybuzz_flight::pilot::{Pilot, PilotSettings};
use bittybuzz_flight::planner::Destination;
use bittybuzz_flight::supervisor::SupervisorStage;

use crate::flight_closed_loop::figures::rms;
use crate::flight_closed_loop::rig::Rig;

/// Displaces the poses of a robot that hovers, and returns its stage and its error in m in the new
/// frame 3 s later.
fn displace(rig: &mut Rig, jump_m: DVec3) -> (SupervisorStage, f64) {
    rig.capture().expect("a capture").set_jump_m(jump_m);
    rig.run(3.0, |_| {});
    let error_m = (rig.estimate_error_m() - jump_m).length();
    (rig.stack.stage(), error_m)
}

/// Builds of each test.
const SEEDS: std::ops::RangeInclusive<u64> = 1..=10;

#[test]
fn a_jump_below_the_limit_is_adopted() {
    for seed in SEEDS {
        for x in [0.03, 0.1, 0.29] {
            let mut rig = Rig::with_capture(seed);
            rig.take_off(0.8);
            let (stage, error_m) = displace(&mut rig, DVec3::X * x);
            assert_eq!(stage, SupervisorStage::Flying, "{x}");
            assert!(error_m < 0.01, "{x}: {error_m}");
            assert!(rig.own_error_m() < 0.05, "{x}: {}", rig.own_error_m());
        }
    }
}

#[test]
fn a_larger_jump_ends_the_flight() {
    for seed in SEEDS {
        let mut rig = Rig::with_capture(seed);
        rig.take_off(0.8);
        let mut fault_ms = 0;
        rig.capture().expect("a capture").set_jump_m(DVec3::X * 0.35);
        rig.run(0.6, |rig| {
            fault_ms += u64::from(rig.stack.stage() == SupervisorStage::Flying);
        });
        // The trust ends after 0.43 s, the position half a second after the last accepted pose.
        assert_eq!(rig.stack.stage(), SupervisorStage::LevelOut, "{fault_ms}");
        rig.run(8.0, |_| {});
        assert!(!rig.drone.has_crashed() && rig.drone.state().position_m.z < 0.02);
    }
}

/// The poses of a neighbor that the pilot reports are not adopted, however near it is.
#[test]
fn the_place_of_another_robot_is_not_adopted() {
    let fly = |hears: bool| {
        let mut rig = Rig::with_capture(1);
        rig.take_off(0.8);
        let neighbor_m = rig.stack.state().position_m + Vec3::X * 0.25;
        rig.capture().expect("a capture").set_jump_m(DVec3::X * 0.25);
        let mut pilot = Pilot::new(PilotSettings::CRAZYFLIE);
        let report =
            PeerReport { id: 1, position_m: neighbor_m, velocity_m_s: None, measured_at_ms: 0 };
        rig.run(1.0, |rig| {
            if hears {
                pilot.update_peer(report, &mut rig.stack).expect("a pilot without avoidance");
            }
        });
        rig.stack.stage()
    };
    assert_eq!(fly(true), SupervisorStage::LevelOut);
    assert_eq!(fly(false), SupervisorStage::Flying);
}

/// A single marker or a radio beacon gives positions without attitude.
#[test]
fn positions_without_attitude_are_enough() {
    for seed in SEEDS {
        let mut rig = Rig::with_capture(seed);
        rig.sends_positions = true;
        rig.take_off(0.8);
        let destination = Destination::Relative { displacement_m: Vec3::X, turn_rad: 0.0 };
        rig.stack.go_to(destination, Some(2.0)).expect("refused");
        let mut errors = Vec::new();
        rig.run(10.0, |rig| errors.push(rig.true_error_m()));
        assert!(rms(&errors) < 0.03, "{seed}: {}", rms(&errors));
        let (stage, error_m) = displace(&mut rig, DVec3::Y * 0.2);
        assert_eq!(stage, SupervisorStage::Flying);
        assert!(error_m < 0.01, "{error_m}");
    }
}

/// Poses that are 90 ms old, by a slow radio whose delay is known.
#[test]
fn old_poses_of_a_known_age_are_enough() {
    for seed in SEEDS {
        let mut rig = Rig::with_capture(seed);
        rig.capture().expect("a capture").set_latency_steps(90);
        rig.take_off(0.8);
        let destination = Destination::Relative { displacement_m: Vec3::X, turn_rad: 0.0 };
        rig.stack.go_to(destination, Some(2.0)).expect("refused");
        let mut errors = Vec::new();
        rig.run(3.0, |rig| errors.push(rig.true_error_m()));
        assert!(rms(&errors) < 0.03, "{seed}: {}", rms(&errors));
    }
}
