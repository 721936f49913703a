//! Limits that the robot's owner wrote to its flash.

use bittybuzz_crtp::{Parameter, Refusal};
use bittybuzz_flight::Vec3;
use bittybuzz_flight::pilot::PilotSettings;
use bittybuzz_flight::planner::PositionFence;
use bittybuzz_station::{Outcome, OwnerLimit};

use super::rig::Rig;
use super::{ARM, GO_RELATIVE, TAKE_OFF, near, write};

/// A robot in a room whose origin is not in the middle.
const OWNER: [(OwnerLimit, f32); 7] = [
    (OwnerLimit::Speed, 0.4),
    (OwnerLimit::Climb, 0.3),
    (OwnerLimit::Height, 0.9),
    (OwnerLimit::Front, 0.6),
    (OwnerLimit::Back, 0.0),
    (OwnerLimit::Left, 2.0),
    (OwnerLimit::Right, 0.3),
];

#[test]
fn a_robot_without_them_has_those_of_the_pilot() {
    let rig = Rig::new(40);
    let own = (PilotSettings::CRAZYFLIE.limits, PositionFence::WIDE);
    assert_eq!(rig.station.limits(), Some(own));
}

#[test]
fn the_robot_stays_in_the_fence_at_the_speed_of_its_owner() {
    let mut rig = Rig::with_limits(42, &OWNER);
    let (limits, fence) = rig.station.limits().unwrap();
    assert_eq!((limits.speed_m_s, limits.climb_m_s), (0.4, 0.3));
    assert_eq!(fence.least_m(), Vec3::new(0.0, -0.3, -1000.0));
    assert_eq!(fence.most_m(), Vec3::new(0.6, 2.0, 0.9));
    rig.stay(500);
    rig.command(ARM);
    rig.command(TAKE_OFF);
    rig.stay(4000);
    // 1 m to the front, 0.5 m to the right and 0.75 m up, in 2.5 s.
    rig.command(GO_RELATIVE);
    let mut fastest_m_s = Vec3::ZERO;
    for _ in 0..12 {
        rig.stay(500);
        fastest_m_s = fastest_m_s.max(rig.stack.state().velocity_m_s.abs());
    }
    near(&rig, Vec3::new(0.6, -0.3, 0.9), 0.03);
    assert!(fastest_m_s.truncate().length() < 0.45 && fastest_m_s.z < 0.33, "{fastest_m_s}");
}

#[test]
fn no_station_loosens_them_on_the_ground() {
    let mut rig = Rig::with_limits(43, &OWNER);
    let before = rig.station.limits();
    for (parameter, value) in [
        (Parameter::PosCtlXVelMax, 0.5),
        (Parameter::PosCtlYVelMax, 0.5),
        (Parameter::PosCtlZVelMax, 0.5),
        (Parameter::FenceMostZ, 1.0),
        (Parameter::FenceMostX, 1.0),
        (Parameter::FenceLeastX, -0.1),
        (Parameter::FenceMostY, 2.1),
        (Parameter::FenceLeastY, -0.4),
    ] {
        assert_eq!(rig.send(&write(parameter, value)).0, None, "{parameter:?}");
    }
    assert_eq!(rig.station.refusals().of(Refusal::OutOfRange), 8);
    assert_eq!(rig.station.limits(), before);
    // Tighter ones count, and can be taken back.
    for height_m in [0.5, 0.9] {
        let (outcome, _) = rig.send(&write(Parameter::FenceMostZ, height_m));
        assert_eq!(outcome, Some(Outcome::Done));
        assert_eq!(rig.station.limits().unwrap().1.most_m().z, height_m);
    }
}
