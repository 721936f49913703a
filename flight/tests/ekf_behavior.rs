//! Behavior of the Kalman filter at its limits: late, wrong and missing measurements.

use bittybuzz_flight::ekf::{
    Ekf, EkfConfig, EkfOutcome, EkfRefusal, EkfSigma, FlowMeasurement, PoseMeasurement,
    PositionMeasurement,
};
use bittybuzz_flight::{FlightState, ImuSample, Quat, Vec3};
use glam::EulerRot;
use proptest::prelude::*;

const HOVER: ImuSample =
    ImuSample { gyro_rad_s: Vec3::ZERO, accel_m_s2: Vec3::new(0.0, 0.0, 9.81) };

fn hovering_at(position_m: Vec3) -> Ekf {
    let start = FlightState { position_m, ..FlightState::default() };
    let mut filter = Ekf::new(EkfConfig::QUADROTOR, &start);
    filter.set_flying(true);
    filter
}

fn propagate(filter: &mut Ekf, imu: &ImuSample, steps: usize) {
    for _ in 0..steps {
        assert_eq!(filter.propagate(imu, 0.001), Ok(()));
    }
}

fn position(position_m: Vec3) -> PositionMeasurement {
    PositionMeasurement { position_m, sigma_m: 0.001, age_s: 0.0 }
}

fn sigma(filter: &Ekf, state: usize) -> f32 {
    filter.covariance()[state][state].sqrt()
}

/// Flies hover with exact positions for a second.
fn settled() -> Ekf {
    let mut filter = hovering_at(Vec3::Z);
    for _ in 0..100 {
        propagate(&mut filter, &HOVER, 10);
        assert!(filter.update_position(&position(Vec3::Z)).is_accepted());
    }
    filter
}

#[test]
fn late_positions_of_a_fast_robot_leave_no_lag() {
    let fly = |declared_age_s: f32| {
        let start = FlightState { velocity_m_s: Vec3::X * 0.95, ..FlightState::default() };
        let mut filter = Ekf::new(EkfConfig::QUADROTOR, &start);
        filter.set_flying(true);
        let mut error = Vec3::ZERO;
        for step in 1..=3000 {
            propagate(&mut filter, &HOVER, 1);
            let time_s = step as f32 * 0.001;
            if step % 10 == 0 && step > 50 {
                // The robot flies at 1 m/s; the position is 10 ms old.
                let position_m = Vec3::X * (time_s - 0.01);
                let measured =
                    PositionMeasurement { position_m, sigma_m: 0.001, age_s: declared_age_s };
                let _ = filter.update_position(&measured);
                error = filter.state().position_m - Vec3::X * time_s;
            }
        }
        (error.length(), (filter.state().velocity_m_s - Vec3::X).length())
    };
    let (error, velocity_error) = fly(0.01);
    assert!(error < 1e-3, "error {error}");
    assert!(velocity_error < 0.01, "velocity error {velocity_error}");
    let (lag, _) = fly(0.0);
    assert!((lag - 0.01).abs() < 1e-3, "lag {lag}");
}

#[test]
fn late_poses_of_a_turning_robot_leave_no_lag() {
    let mut filter = hovering_at(Vec3::Z);
    let imu = ImuSample { gyro_rad_s: Vec3::Z * 2.0, ..HOVER };
    for step in 1..=3000 {
        propagate(&mut filter, &imu, 1);
        if step % 10 == 0 && step > 50 {
            let yaw = 2.0 * (step as f32 * 0.001 - 0.02);
            let outcome = filter.update_pose(&PoseMeasurement {
                position_m: Vec3::Z,
                attitude: Quat::from_rotation_z(yaw),
                sigma_m: 0.001,
                sigma_rad: 0.01,
                age_s: 0.02,
            });
            assert!(outcome.is_accepted(), "step {step}: {outcome:?}");
        }
    }
    let error = filter.state().attitude.angle_between(Quat::from_rotation_z(6.0));
    assert!(error < 2e-3, "error {error}");
}

#[test]
fn the_history_spans_100_ms_and_ends_at_a_reset() {
    let mut filter = settled();
    let aged = |age_s| PositionMeasurement { age_s, ..position(Vec3::Z) };
    assert!(filter.update_position(&aged(0.1)).is_accepted());
    let too_old = EkfOutcome::Refused(EkfRefusal::TooOld);
    assert_eq!(filter.update_position(&aged(0.106)), too_old);
    filter.reset(&FlightState::default());
    assert_eq!(filter.update_position(&aged(0.01)), too_old);
    propagate(&mut filter, &HOVER, 10);
    assert!(filter.update_position(&aged(0.01)).is_accepted());
}

#[test]
fn wrong_numbers_are_refused_and_change_nothing() {
    let mut filter = settled();
    let before = (filter.state(), filter.covariance());
    let good = position(Vec3::Z);
    let nan = f32::NAN;
    let cases = [
        (
            PositionMeasurement { position_m: Vec3::new(0.0, nan, 0.0), ..good },
            EkfRefusal::NotFinite,
        ),
        (PositionMeasurement { sigma_m: nan, ..good }, EkfRefusal::NotFinite),
        (PositionMeasurement { sigma_m: 0.0, ..good }, EkfRefusal::OutOfRange),
        (PositionMeasurement { age_s: -0.001, ..good }, EkfRefusal::OutOfRange),
        (PositionMeasurement { age_s: f32::INFINITY, ..good }, EkfRefusal::NotFinite),
        (PositionMeasurement { age_s: 1.0, ..good }, EkfRefusal::TooOld),
    ];
    for (measured, refusal) in cases {
        assert_eq!(filter.update_position(&measured), EkfOutcome::Refused(refusal));
    }
    let pose = PoseMeasurement {
        position_m: Vec3::Z,
        attitude: Quat::from_xyzw(0.0, 0.0, 0.0, 0.0),
        sigma_m: 0.001,
        sigma_rad: 0.01,
        age_s: 0.0,
    };
    assert_eq!(filter.update_pose(&pose), EkfOutcome::Refused(EkfRefusal::OutOfRange));
    assert_eq!(filter.update_range(-1.0, 0.01), EkfOutcome::Refused(EkfRefusal::OutOfRange));
    assert_eq!(filter.update_height(nan, 0.01), EkfOutcome::Refused(EkfRefusal::NotFinite));
    assert_eq!(filter.update_yaw(nan, 0.01), EkfOutcome::Refused(EkfRefusal::NotFinite));
    let flow = FlowMeasurement { counts_x: 0.0, counts_y: 0.0, sigma_counts: 2.0, seconds: 0.15 };
    assert_eq!(filter.update_flow(&flow), EkfOutcome::Refused(EkfRefusal::TooOld));
    assert_eq!(filter.propagate(&HOVER, 0.0), Err(EkfRefusal::OutOfRange));
    assert_eq!(filter.propagate(&HOVER, nan), Err(EkfRefusal::OutOfRange));
    assert_eq!((filter.state(), filter.covariance()), before);
}

#[test]
fn sample_that_is_not_finite_does_not_accelerate() {
    let mut filter = settled();
    let broken = ImuSample { gyro_rad_s: Vec3::NAN, ..HOVER };
    for _ in 0..100 {
        assert_eq!(filter.propagate(&broken, 0.001), Err(EkfRefusal::NotFinite));
    }
    assert!((filter.state().position_m - Vec3::Z).length() < 2e-3);
    assert_eq!(filter.health().divergences, 0);
}

#[test]
fn jump_is_rejected_reported_and_adopted_on_request() {
    let mut filter = settled();
    let elsewhere = Vec3::new(1.0, 0.5, 1.0);
    for step in 1..=60 {
        propagate(&mut filter, &HOVER, 10);
        let outcome = filter.update_position(&position(elsewhere));
        assert!(matches!(outcome, EkfOutcome::Rejected { distance_ratio } if distance_ratio > 1.0));
        assert!((filter.state().position_m - Vec3::Z).length() < 0.02);
        if step != 51 {
            // Rounding decides about the moment at 0.5 s.
            assert_eq!(filter.health().is_lost, step > 51, "step {step}");
        }
    }
    let health = filter.health();
    assert_eq!(health.rejections, 60);
    assert!(!health.is_position_valid && !health.is_height_valid && health.is_attitude_valid);
    filter.adopt_position(&position(elsewhere)).unwrap();
    assert!(!filter.health().is_lost && filter.health().is_position_valid);
    propagate(&mut filter, &HOVER, 10);
    assert!(filter.update_position(&position(elsewhere)).is_accepted());
}

#[test]
fn positions_that_contradict_each_other_are_not_a_jump() {
    let mut filter = settled();
    for step in 0..100 {
        propagate(&mut filter, &HOVER, 10);
        let side = if step % 2 == 0 { 1.0 } else { -1.0 };
        let outcome = filter.update_position(&position(Vec3::new(side, 0.0, 1.0)));
        assert!(!outcome.is_accepted());
    }
    assert!(!filter.health().is_lost);
    assert!(!filter.health().is_position_valid);
}

#[test]
fn flipped_attitude_rejects_the_whole_pose() {
    let mut filter = settled();
    let before = filter.state();
    let outcome = filter.update_pose(&PoseMeasurement {
        position_m: Vec3::new(0.001, 0.0, 1.0),
        attitude: Quat::from_rotation_z(3.1),
        sigma_m: 0.001,
        sigma_rad: 0.01,
        age_s: 0.0,
    });
    assert!(matches!(outcome, EkfOutcome::Rejected { .. }));
    assert_eq!(filter.state(), before);
}

#[test]
fn adopted_pose_replaces_the_attitude() {
    let mut filter = settled();
    let attitude = Quat::from_rotation_z(2.0);
    let pose = PoseMeasurement {
        position_m: Vec3::X,
        attitude,
        sigma_m: 0.01,
        sigma_rad: 0.1,
        age_s: 0.0,
    };
    filter.adopt_pose(&pose).unwrap();
    assert_eq!(filter.state().position_m, Vec3::X);
    assert!(filter.state().attitude.angle_between(attitude) < 1e-3);
    assert!((sigma(&filter, 8) - 0.1).abs() < 1e-6);
    propagate(&mut filter, &HOVER, 5);
    // The past turned too, so a late pose agrees.
    assert!(filter.update_pose(&PoseMeasurement { age_s: 0.02, ..pose }).is_accepted());
}

#[test]
fn divergence_restarts_and_is_reported() {
    let mut filter = hovering_at(Vec3::Z);
    let fall = ImuSample::default();
    propagate(&mut filter, &fall, 1100);
    let health = filter.health();
    assert_eq!(health.divergences, 1);
    assert!(!health.is_position_valid && !health.is_velocity_valid && !health.is_attitude_valid);
    assert!(filter.state().velocity_m_s.length() < 10.0);
    assert!(sigma(&filter, 0) > 9.0);
}

#[test]
fn health_expires_without_measurements() {
    let mut filter = settled();
    let health = filter.health();
    assert!(health.is_position_valid && health.is_height_valid && health.is_velocity_valid);
    propagate(&mut filter, &HOVER, 490);
    assert!(filter.health().is_position_valid);
    propagate(&mut filter, &HOVER, 20);
    let health = filter.health();
    assert!(!health.is_position_valid && !health.is_height_valid && !health.is_velocity_valid);
    assert!(health.is_attitude_valid && !health.is_lost);
}

/// The robot swings by its pitch above one point; its rate alone moves the picture.
#[test]
fn flow_of_a_swinging_robot_is_not_a_velocity() {
    let mut filter = hovering_at(Vec3::Z);
    let k = 0.01 * 350.0 / 0.71674;
    let (mut pitch, mut worst) = (0.0f32, 0.0f32);
    for step in 0..2000 {
        let rate = 0.5 * (0.001 * step as f32 * 12.0).cos();
        pitch += rate * 0.001;
        // A thrust that keeps the height; the tilt of 0.04 rad also accelerates.
        let imu = ImuSample { gyro_rad_s: Vec3::Y * rate, ..HOVER };
        propagate(&mut filter, &imu, 1);
        if step % 10 == 9 {
            let velocity = filter.body_velocity_m_s().x;
            let cos = pitch.cos();
            let height = filter.state().position_m.z;
            let outcome = filter.update_flow(&FlowMeasurement {
                counts_x: k * (velocity * cos / height - rate),
                counts_y: 0.0,
                sigma_counts: 2.0,
                seconds: 0.01,
            });
            assert!(outcome.is_accepted());
            worst = worst.max((filter.body_velocity_m_s().x - velocity).abs());
            assert!(filter.update_height(1.0, 0.01).is_accepted());
        }
    }
    assert!(worst < 2e-3, "a correction of {worst} m/s");
}

#[test]
fn flow_finds_an_unknown_velocity() {
    let sigma = EkfSigma { velocity_m_s: 0.5, ..EkfConfig::QUADROTOR.initial_sigma };
    let config = EkfConfig { initial_sigma: sigma, ..EkfConfig::QUADROTOR };
    let start = FlightState { position_m: Vec3::Z, ..FlightState::default() };
    let mut filter = Ekf::new(config, &start);
    filter.set_flying(true);
    let k = 0.01 * 350.0 / 0.71674;
    for _ in 0..200 {
        propagate(&mut filter, &HOVER, 10);
        let flow = FlowMeasurement {
            counts_x: 0.4 * k,
            counts_y: -0.2 * k,
            sigma_counts: 2.0,
            seconds: 0.01,
        };
        assert!(filter.update_flow(&flow).is_accepted());
        assert!(filter.update_range(1.0, 0.005).is_accepted());
    }
    let error = filter.state().velocity_m_s - Vec3::new(0.4, -0.2, 0.0);
    assert!(error.length() < 0.02, "error {error}");
}

#[test]
fn a_tilt_within_the_cone_does_not_change_the_range() {
    let tilted = |tilt: f32, range_m: f32| {
        let start = FlightState {
            position_m: Vec3::Z,
            attitude: Quat::from_rotation_x(tilt),
            ..FlightState::default()
        };
        let mut filter = Ekf::new(EkfConfig::QUADROTOR, &start);
        let outcome = filter.update_range(range_m, 0.001);
        (outcome, filter.state().position_m.z)
    };
    let (outcome, z) = tilted(0.1, 1.1);
    assert!(outcome.is_accepted() && (z - 1.1).abs() < 1e-4);
    let outside = 0.5 - 7.5f32.to_radians();
    let (outcome, z) = tilted(0.5, 1.1 / outside.cos());
    assert!(outcome.is_accepted() && (z - 1.1).abs() < 1e-4, "height {z}");
    let (outcome, _) = tilted(1.5, 1.0);
    assert_eq!(outcome, EkfOutcome::Refused(EkfRefusal::TooTilted));
}

/// The robot rises at 1 m/s and the distance is 25 ms old, so it is 25 mm too short.
#[test]
fn a_late_range_belongs_to_its_time() {
    let velocity_m_s = Vec3::Z;
    let start = FlightState { position_m: Vec3::Z, velocity_m_s, ..FlightState::default() };
    let mut filter = Ekf::new(EkfConfig::QUADROTOR, &start);
    filter.set_flying(true);
    propagate(&mut filter, &HOVER, 100);
    let mut late = filter;
    assert!(late.update_late_range(1.075, 0.001, 0.025).is_accepted());
    assert!((late.state().position_m.z - 1.1).abs() < 1e-4, "{:?}", late.state());
    let too_old = filter.update_late_range(1.0, 0.001, 0.106);
    assert_eq!(too_old, EkfOutcome::Refused(EkfRefusal::TooOld));
}

#[test]
fn yaw_turns_about_world_z() {
    let start = FlightState {
        attitude: Quat::from_euler(EulerRot::ZYX, 3.1, 0.3, -0.2),
        ..FlightState::default()
    };
    let mut filter = Ekf::new(EkfConfig::QUADROTOR, &start);
    // 3.1 + 0.1 rad, on the other side of ±π.
    let target = 3.2 - std::f32::consts::TAU;
    for _ in 0..3 {
        assert!(filter.update_yaw(target, 0.001).is_accepted());
    }
    let (yaw, pitch, roll) = filter.state().attitude.to_euler(EulerRot::ZYX);
    assert!((yaw - target).abs() < 1e-3, "yaw {yaw}");
    assert!((pitch - 0.3).abs() < 0.04 && (roll + 0.2).abs() < 0.04, "{pitch} {roll}");
}

#[test]
fn attitude_stays_a_rotation_and_follows_a_long_turn() {
    let mut filter = hovering_at(Vec3::Z);
    filter.set_flying(false);
    let rate = 1.0;
    let steps = 200_000;
    for step in 0..steps {
        // The specific force of a robot that stands on a turntable.
        let imu = ImuSample { gyro_rad_s: Vec3::Z * rate, ..HOVER };
        filter.propagate(&imu, 0.001).unwrap();
        if step % 100 == 0 {
            let _ = filter.update_position(&position(Vec3::Z));
        }
    }
    let attitude = filter.state().attitude;
    assert!((attitude.length() - 1.0).abs() < 1e-6);
    let error = attitude.angle_between(Quat::from_rotation_z(rate * steps as f32 * 0.001));
    assert!(error < 0.02, "error {error}");
}

#[test]
fn drag_slows_along_body_axes_in_flight_alone() {
    let config = EkfConfig { drag_per_s: Vec3::new(0.4, 0.2, 0.0), ..EkfConfig::QUADROTOR };
    let start = FlightState { velocity_m_s: Vec3::new(1.0, 1.0, 0.0), ..FlightState::default() };
    let mut filter = Ekf::new(config, &start);
    propagate(&mut filter, &HOVER, 1000);
    assert!((filter.state().velocity_m_s - start.velocity_m_s).length() < 1e-3);
    filter.set_flying(true);
    for _ in 0..1000 {
        // The accelerometer measures the drag.
        let drag_m_s2 = -config.drag_per_s * filter.body_velocity_m_s();
        let imu = ImuSample { accel_m_s2: HOVER.accel_m_s2 + drag_m_s2, ..HOVER };
        propagate(&mut filter, &imu, 1);
    }
    let velocity = filter.state().velocity_m_s;
    assert!((velocity.x - (-0.4f32).exp()).abs() < 1e-3);
    assert!((velocity.y - (-0.2f32).exp()).abs() < 1e-3);
}

/// A fan pushes a level robot by 2 m/s² and the accelerometer shows it.
#[test]
fn an_outer_force_moves_the_estimate() {
    let mut filter = Ekf::new(EkfConfig::QUADROTOR, &FlightState::default());
    filter.set_flying(true);
    let pushed = ImuSample { accel_m_s2: HOVER.accel_m_s2 + Vec3::X * 2.0, ..HOVER };
    propagate(&mut filter, &pushed, 500);
    let speed = filter.state().velocity_m_s.x;
    // The mean of 40 ms comes 40 ms late, and 4 % of the force do not count.
    assert!((0.86..1.0).contains(&speed), "{speed}");
    // An offset of the sensor does not count.
    let mut level = Ekf::new(EkfConfig::QUADROTOR, &FlightState::default());
    level.set_flying(true);
    let offset = ImuSample { accel_m_s2: HOVER.accel_m_s2 + Vec3::X * 0.3, ..HOVER };
    propagate(&mut level, &offset, 500);
    assert_eq!(level.state().velocity_m_s.x, 0.0);
}

/// A table of 0.3 m comes below the robot, whose height in the world stays.
#[test]
fn a_step_of_the_floor_moves_the_floor() {
    let mut filter = hovering_at(Vec3::Z);
    let range = |filter: &mut Ekf, range_m: f32| {
        propagate(filter, &HOVER, 25);
        filter.update_range(range_m, 0.0025).is_accepted()
    };
    (0..10).for_each(|_| assert!(range(&mut filter, 1.0)));
    assert!([0.7, 0.702, 0.698].into_iter().all(|range_m| !range(&mut filter, range_m)));
    assert!((filter.floor_m() - 0.3).abs() < 0.003, "{}", filter.floor_m());
    assert!((0..10).all(|_| range(&mut filter, 0.7)));
    assert!((filter.state().position_m.z - 1.0).abs() < 0.003, "{:?}", filter.state());
    assert!((filter.height_above_floor_m() - 0.7).abs() < 0.003);
}

/// Poses that are displaced by 0.1 m are rejected at first and are a fact after 0.3 s; poses that
/// disagree with each other are not.
#[test]
fn displaced_positions_are_a_fact_after_a_while() {
    let displaced_after = |shift: fn(usize) -> f32| {
        let mut filter = settled();
        (1..=60).position(|number| {
            propagate(&mut filter, &HOVER, 10);
            let place_m = Vec3::new(shift(number), 0.0, 1.0);
            let _ = filter.update_position(&position(place_m));
            filter.health().is_displaced
        })
    };
    let after = displaced_after(|_| 0.1);
    assert!(matches!(after, Some(33 | 34)), "{after:?} of 10 ms: 3 agree, and then 0.3 s");
    assert_eq!(displaced_after(|number| 0.1 + 0.1 * (number % 2) as f32), None);
    assert_eq!(displaced_after(|_| 0.015), None, "a small displacement is accepted");
}

/// Any bit pattern, since a driver or the radio may deliver it.
fn any_number() -> impl Strategy<Value = f32> {
    prop_oneof![any::<u32>().prop_map(f32::from_bits), -2.0f32..2.0, Just(0.0)]
}

fn any_vector() -> impl Strategy<Value = Vec3> {
    prop::array::uniform3(any_number()).prop_map(Vec3::from)
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_input_makes_the_estimate_unusable(
        inputs in prop::collection::vec(
            (0u8..9, any_vector(), any_vector(), any_number(), any_number()), 1..60),
    ) {
        let mut filter = hovering_at(Vec3::Z);
        for (kind, a, b, c, d) in inputs {
            match kind {
                0 => { let _ = filter.propagate(&ImuSample { gyro_rad_s: a, accel_m_s2: b }, c); }
                1 => {
                    let _ = filter.update_position(
                        &PositionMeasurement { position_m: a, sigma_m: c, age_s: d });
                }
                2 => {
                    let attitude = Quat::from_xyzw(b.x, b.y, b.z, c);
                    let _ = filter.update_pose(&PoseMeasurement {
                        position_m: a, attitude, sigma_m: d.abs(), sigma_rad: c.abs(), age_s: 0.0 });
                }
                3 => { let _ = filter.update_height(c, d); }
                4 => { let _ = filter.update_range(c, d); }
                5 => {
                    let _ = filter.update_flow(&FlowMeasurement {
                        counts_x: a.x, counts_y: a.y, sigma_counts: c, seconds: 0.002 });
                }
                6 => { let _ = filter.update_yaw(c, d); }
                7 => {
                    let _ = filter.adopt_position(
                        &PositionMeasurement { position_m: a, sigma_m: c, age_s: 0.0 });
                }
                _ => filter.reset(&FlightState {
                    position_m: a, velocity_m_s: b, attitude: Quat::from_xyzw(a.x, b.x, c, d),
                    rate_rad_s: a }),
            }
            propagate(&mut filter, &HOVER, 12);
            let state = filter.state();
            prop_assert!(state.position_m.is_finite() && state.velocity_m_s.is_finite());
            prop_assert!((state.attitude.length() - 1.0).abs() < 1e-3);
            let covariance = filter.covariance();
            for (i, row) in covariance.iter().enumerate() {
                prop_assert!((0.0..=100.0).contains(&row[i]), "state {}", i);
                prop_assert!(row.iter().all(|entry| entry.is_finite()));
            }
        }
    }
}
