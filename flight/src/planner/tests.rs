//! Tests of whole flights: every sample of a reference is checked against limits, fence and
//! continuity.

use super::velocity::wrapped;
use super::*;
use crate::polynomial::tests::solve_with_jerk;
use crate::polynomial::{PEAK_ACCELERATION, PEAK_SPEED};
use core::f32::consts::PI;
use proptest::prelude::*;
use std::vec::Vec;

const STEP_S: f64 = 0.005;
const LIMITS: FlightLimits = FlightLimits::CRAZYFLIE;

fn fence() -> PositionFence {
    PositionFence::new(Vec3::new(-1.5, -1.0, 0.3), Vec3::new(1.5, 1.0, 2.0)).unwrap()
}

/// A planner whose references are checked one by one.
struct CheckedFlight {
    planner: Planner<32>,
    now_s: f64,
    last: Option<Reference>,
    /// Lowest height allowed: below the fence near take-off and landing.
    floor_m: f32,
}

impl CheckedFlight {
    /// Returns a flight that hovers at (0, 0, 1).
    fn hovering() -> Self {
        let planner = Planner::new(LIMITS, fence()).unwrap();
        let mut flight = CheckedFlight { planner, now_s: 100.0, last: None, floor_m: 0.0 };
        let report = flight.planner.take_off(100.0, Vec3::ZERO, 0.0, 1.0, None).unwrap();
        flight.run(report.duration_s as f64 + 0.1);
        assert!(flight.planner.is_done());
        assert!(flight.last.unwrap().position_m.distance(Vec3::Z) < 1e-6);
        flight.floor_m = fence().least_m().z;
        flight
    }

    fn run(&mut self, duration_s: f64) -> Vec<Reference> {
        let steps = (duration_s / STEP_S).ceil() as usize;
        (0..steps).filter_map(|_| self.step()).collect()
    }

    /// Checks the same moment again after a command: nothing may jump.
    fn check_no_jump(&mut self) {
        let (Some(last), Some(now)) = (self.last, self.planner.reference(self.now_s)) else {
            return;
        };
        assert!(now.position_m.distance(last.position_m) < 1e-5, "{last:?} {now:?}");
        assert!(now.velocity_m_s.distance(last.velocity_m_s) < 1e-4, "{last:?} {now:?}");
        assert!(now.acceleration_m_s2.distance(last.acceleration_m_s2) < 1e-3, "{last:?} {now:?}");
        assert!(wrapped(now.yaw_rad - last.yaw_rad).abs() < 1e-5);
        assert!((now.yaw_rate_rad_s - last.yaw_rate_rad_s).abs() < 1e-5);
    }

    fn step(&mut self) -> Option<Reference> {
        self.now_s += STEP_S;
        let now = self.planner.reference(self.now_s);
        if let Some(now) = now {
            self.check_bounds(&now);
            if let Some(last) = self.last {
                check_continuity(&last, &now);
            }
        }
        self.last = now;
        now
    }

    fn check_bounds(&self, now: &Reference) {
        let (v, a) = (now.velocity_m_s, now.acceleration_m_s2);
        assert!(v.truncate().length() <= LIMITS.speed_m_s * 1.002, "speed {now:?}");
        assert!(v.z.abs() <= LIMITS.climb_m_s * 1.002, "climb {now:?}");
        assert!(a.length() <= LIMITS.acceleration_m_s2 * 1.002, "acceleration {now:?}");
        assert!(now.jerk_m_s3.length() <= LIMITS.jerk_m_s3 * 1.01, "jerk {now:?}");
        assert!(now.yaw_rate_rad_s.abs() <= LIMITS.yaw_rate_rad_s * 1.002, "yaw {now:?}");
        assert!((-PI..=PI).contains(&now.yaw_rad));
        let (least, most) = (fence().least_m(), fence().most_m());
        let fence = PositionFence::new(least.with_z(self.floor_m), most).unwrap();
        assert!(fence.contains(now.position_m), "fence {now:?}");
    }
}

/// Checks that each quantity is the integral of the next one, as far as the jerk is limited.
fn check_continuity(last: &Reference, now: &Reference) {
    let dt = STEP_S as f32;
    let mean = (last.velocity_m_s + now.velocity_m_s) * (0.5 * dt);
    let error = (now.position_m - last.position_m).distance(mean);
    // Clamping at the fence may hide up to 0.1 mm.
    assert!(error < 1.2e-4, "position {error} {last:?} {now:?}");
    let mean = (last.acceleration_m_s2 + now.acceleration_m_s2) * (0.5 * dt);
    let error = (now.velocity_m_s - last.velocity_m_s).distance(mean);
    assert!(error < 1e-3, "velocity {error} {last:?} {now:?}");
    let change = now.acceleration_m_s2.distance(last.acceleration_m_s2);
    assert!(change < LIMITS.jerk_m_s3 * dt * 1.02 + 2e-3, "acceleration {change} {last:?} {now:?}");
    let turn = wrapped(now.yaw_rad - last.yaw_rad);
    let mean = (last.yaw_rate_rad_s + now.yaw_rate_rad_s) * (0.5 * dt);
    assert!((turn - mean).abs() < 1e-3, "yaw {last:?} {now:?}");
    let most = 2.0 * LIMITS.yaw_rate_rad_s * LIMITS.jerk_m_s3 / (2.0 * LIMITS.acceleration_m_s2);
    let change = (now.yaw_rate_rad_s - last.yaw_rate_rad_s).abs();
    assert!(change < most * dt * 1.01, "yaw rate {last:?} {now:?}");
}

fn absolute(x: f32, y: f32, z: f32) -> Destination {
    Destination::Absolute { position_m: Vec3::new(x, y, z), yaw_rad: None }
}

/// A command of a random flight.
#[derive(Clone, Copy, Debug)]
enum Order {
    GoTo(Destination, Option<f32>),
    Velocity(VelocityCommand),
    Hover,
    Land,
}

prop_compose! {
    /// Vectors that often point outside the fence.
    fn vector(size: f32)(
        x in -1.0_f32..1.0, y in -1.0_f32..1.0, z in -1.0_f32..1.0,
    ) -> Vec3 {
        Vec3::new(x, y, z) * size
    }
}

fn order() -> impl Strategy<Value = Order> {
    let duration = || prop::option::of(0.1_f32..6.0);
    let yaw = || prop::option::of(-7.0_f32..7.0);
    let frame = prop_oneof![Just(VelocityFrame::World), Just(VelocityFrame::Yaw)];
    prop_oneof![
        4 => (vector(3.0), yaw(), duration()).prop_map(|(position_m, yaw_rad, duration_s)| {
            Order::GoTo(Destination::Absolute { position_m, yaw_rad }, duration_s)
        }),
        2 => (vector(2.0), -4.0_f32..4.0, duration()).prop_map(|(displacement_m, turn_rad, d)| {
            Order::GoTo(Destination::Relative { displacement_m, turn_rad }, d)
        }),
        4 => (frame, vector(3.0), -4.0_f32..4.0).prop_map(|(frame, velocity_m_s, yaw_rate)| {
            Order::Velocity(VelocityCommand { frame, velocity_m_s, yaw_rate_rad_s: yaw_rate })
        }),
        2 => Just(Order::Hover),
        1 => Just(Order::Land),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn random_orders_at_random_times_never_break_a_limit(
        orders in prop::collection::vec((order(), 0.0_f64..3.0), 1..12),
    ) {
        let mut flight = CheckedFlight::hovering();
        for (order, pause_s) in orders {
            let (now_s, planner) = (flight.now_s, &mut flight.planner);
            match order {
                Order::GoTo(destination, duration_s) => {
                    planner.go_to(now_s, destination, duration_s).unwrap();
                }
                Order::Velocity(command) => {
                    planner.follow_velocity(now_s, command).unwrap();
                }
                Order::Hover => {
                    planner.hover(now_s).unwrap();
                }
                Order::Land => {
                    flight.floor_m = 0.0;
                    let is_landing = planner.is_landing();
                    prop_assert_eq!(planner.land(now_s, 0.0, None).is_err(), is_landing);
                }
            }
            flight.check_no_jump();
            flight.run(pause_s);
        }
        // The last goal is reached, and every flight can stop.
        let report = flight.planner.go_to(flight.now_s, absolute(0.3, 0.2, 1.1), None).unwrap();
        flight.run(1.3 * report.duration_s as f64 + 2.0);
        let end = flight.last.unwrap();
        prop_assert!(flight.planner.is_done());
        prop_assert!(end.position_m.distance(Vec3::new(0.3, 0.2, 1.1)) < 1e-4);
        prop_assert_eq!(end.velocity_m_s, Vec3::ZERO);
    }

    #[test]
    fn hover_stops_soon_from_any_flight(
        destination in vector(3.0), duration in 0.1_f32..4.0, moment in 0.0_f64..1.0,
    ) {
        let mut flight = CheckedFlight::hovering();
        let destination = Destination::Absolute { position_m: destination, yaw_rad: None };
        let report = flight.planner.go_to(flight.now_s, destination, Some(duration)).unwrap();
        flight.run(moment * report.duration_s as f64);
        flight.planner.hover(flight.now_s).unwrap();
        flight.check_no_jump();
        flight.run(2.0);
        let speed = flight.last.unwrap().velocity_m_s.length();
        prop_assert!(speed < 5e-3, "{speed}");
    }

    #[test]
    fn arbitrary_bits_are_refused_or_flown(
        numbers in prop::array::uniform6(any::<f32>()), choice in 0..6, now in any::<f64>(),
    ) {
        let mut planner = Planner::<1>::new(LIMITS, fence()).unwrap();
        planner.take_off(0.0, Vec3::ZERO, 0.0, 1.0, None).unwrap();
        planner.reference(0.7);
        let [a, b, c, d, e, f] = numbers;
        let point = Vec3::new(a, b, c);
        // Refused or not: the reference stays finite and inside.
        let _ = match choice {
            0 => planner.go_to(
                now, Destination::Absolute { position_m: point, yaw_rad: Some(d) }, Some(e),
            ),
            1 => planner.go_to(
                now, Destination::Relative { displacement_m: point, turn_rad: d }, None,
            ),
            2 => planner.follow_velocity(now, VelocityCommand {
                frame: VelocityFrame::Yaw, velocity_m_s: point, yaw_rate_rad_s: d,
            }),
            3 => planner.land(now, f, Some(e)),
            4 => { planner.go_idle(); planner.take_off(now, point, d, e, Some(f)) }
            _ => match TrajectoryPiece::new(f, [point; 8], [d; 8]) {
                Some(piece) => planner.follow_trajectory(now, &[piece], true),
                None => planner.hover(now),
            },
        };
        for step in 0..200 {
            if let Some(now) = planner.reference(now.clamp(-1e9, 1e9) + step as f64 * 0.02) {
                prop_assert!(now.position_m.is_finite() && now.velocity_m_s.is_finite());
                prop_assert!(now.acceleration_m_s2.is_finite() && now.snap_m_s4.is_finite());
                prop_assert!(now.yaw_rad.is_finite() && now.yaw_rate_rad_s.is_finite());
            }
        }
    }
}

#[test]
fn go_to_has_the_peaks_of_the_closed_form_and_the_wanted_duration() {
    let mut flight = CheckedFlight::hovering();
    let report = flight.planner.go_to(flight.now_s, absolute(1.0, 0.0, 1.0), Some(2.0)).unwrap();
    assert_eq!(report, PlanReport { duration_s: 2.0, is_clamped: false, brakes_first: false });
    let samples = flight.run(2.0);
    let peak = |value: fn(&Reference) -> f32| samples.iter().map(value).fold(0.0, f32::max);
    assert!((peak(|r| r.velocity_m_s.length()) - PEAK_SPEED / 2.0).abs() < 1e-4);
    assert!((peak(|r| r.acceleration_m_s2.length()) - PEAK_ACCELERATION / 4.0).abs() < 1e-3);
    let halfway = samples[samples.len() / 2 - 1].position_m;
    assert!(halfway.distance(Vec3::new(0.5, 0.0, 1.0)) < 1e-3);
}

#[test]
fn short_durations_are_stretched_until_one_limit_is_reached() {
    let long_way = absolute(1.4, 0.0, 1.0);
    let high = absolute(0.0, 0.0, 1.9);
    let near = absolute(0.01, 0.0, 1.0);
    let far = Vec3::new(1.4, 0.0, 0.0);
    for (destination, displacement) in
        [(long_way, far), (high, Vec3::Z * 0.9), (near, Vec3::X * 0.01)]
    {
        let mut flight = CheckedFlight::hovering();
        let report = flight.planner.go_to(flight.now_s, destination, Some(0.1)).unwrap();
        let samples = flight.run(report.duration_s as f64);
        // The use of each limit, of which the largest one is 1.
        let use_of_limits = samples
            .iter()
            .flat_map(|r| {
                [
                    r.velocity_m_s.truncate().length() / LIMITS.speed_m_s,
                    r.velocity_m_s.z.abs() / LIMITS.climb_m_s,
                    r.acceleration_m_s2.length() / LIMITS.acceleration_m_s2,
                    r.jerk_m_s3.length() / LIMITS.jerk_m_s3,
                ]
            })
            .fold(0.0, f32::max);
        assert!((0.97..1.001).contains(&use_of_limits), "{displacement}: {use_of_limits}");
    }
}

#[test]
fn yaw_takes_the_short_way_within_its_rate() {
    let mut flight = CheckedFlight::hovering();
    let turn = |yaw: f32| Destination::Absolute { position_m: Vec3::Z, yaw_rad: Some(yaw) };
    let report = flight.planner.go_to(flight.now_s, turn(3.0), None).unwrap();
    assert!((report.duration_s - PEAK_SPEED * 3.0 / LIMITS.yaw_rate_rad_s).abs() < 1e-4);
    flight.run(report.duration_s as f64 + 0.1);
    let report = flight.planner.go_to(flight.now_s, turn(-3.0), Some(1.0)).unwrap();
    assert_eq!(report.duration_s, 1.0);
    let samples = flight.run(1.1);
    assert!(samples.iter().all(|r| r.yaw_rad.abs() > 2.999));
    assert!((flight.last.unwrap().yaw_rad + 3.0).abs() < 1e-5);
}

#[test]
fn yaw_reverses_from_full_rate() {
    let mut flight = CheckedFlight::hovering();
    let spin = VelocityCommand { yaw_rate_rad_s: 9.0, ..VelocityCommand::STOP };
    assert!(flight.planner.follow_velocity(flight.now_s, spin).unwrap().is_clamped);
    flight.run(2.0);
    let back = Destination::Relative { displacement_m: Vec3::ZERO, turn_rad: -1.0 };
    let wanted = wrapped(flight.last.unwrap().yaw_rad - 1.0);
    let report = flight.planner.go_to(flight.now_s, back, None).unwrap();
    flight.check_no_jump();
    flight.run(report.duration_s as f64 + 0.1);
    assert!((flight.last.unwrap().yaw_rad - wanted).abs() < 1e-4);
}

#[test]
fn velocity_in_the_frame_of_the_yaw_leads_ahead() {
    let mut flight = CheckedFlight::hovering();
    let left = Destination::Absolute { position_m: Vec3::Z, yaw_rad: Some(PI / 2.0) };
    flight.planner.go_to(flight.now_s, left, None).unwrap();
    flight.run(3.0);
    let ahead = VelocityCommand {
        frame: VelocityFrame::Yaw,
        velocity_m_s: Vec3::new(0.2, 0.1, 0.05),
        yaw_rate_rad_s: 0.0,
    };
    flight.planner.follow_velocity(flight.now_s, ahead).unwrap();
    flight.run(1.5);
    let velocity = flight.last.unwrap().velocity_m_s;
    assert!(velocity.distance(Vec3::new(-0.1, 0.2, 0.05)) < 1e-3, "{velocity}");
}

#[test]
fn velocity_slides_along_a_wall_and_keeps_its_speed() {
    let mut flight = CheckedFlight::hovering();
    flight.planner.go_to(flight.now_s, absolute(-1.4, -0.5, 1.0), None).unwrap();
    flight.run(4.0);
    let oblique = VelocityCommand {
        frame: VelocityFrame::World,
        velocity_m_s: Vec3::new(0.5, 1.0, 0.0),
        yaw_rate_rad_s: 0.0,
    };
    flight.planner.follow_velocity(flight.now_s, oblique).unwrap();
    flight.run(1.0);
    let samples = flight.run(2.5);
    let slowest = samples.iter().map(|r| r.velocity_m_s.x).fold(f32::MAX, f32::min);
    assert!(slowest > 0.49, "{slowest}");
    let end = flight.last.unwrap().position_m;
    assert!(end.y > 0.97, "{end}");
}

#[test]
fn coarse_sampling_flies_the_same_way() {
    let command = VelocityCommand {
        frame: VelocityFrame::Yaw,
        velocity_m_s: Vec3::new(1.0, 0.5, 0.1),
        yaw_rate_rad_s: 0.3,
    };
    let mut fine = CheckedFlight::hovering();
    let mut coarse = fine.planner;
    fine.planner.follow_velocity(fine.now_s, command).unwrap();
    coarse.follow_velocity(fine.now_s, command).unwrap();
    for _ in 0..8 {
        fine.run(0.5);
        let reference = coarse.reference(fine.now_s).unwrap();
        assert!(reference.position_m.distance(fine.last.unwrap().position_m) < 0.01);
    }
    // A gap of a minute takes long steps, but no wall moves.
    assert!(fence().contains(coarse.reference(fine.now_s + 60.0).unwrap().position_m));
}

#[test]
fn destination_outside_is_clamped_and_reported() {
    let mut flight = CheckedFlight::hovering();
    let report = flight.planner.go_to(flight.now_s, absolute(9.0, 0.0, -3.0), None).unwrap();
    assert!(report.is_clamped);
    flight.run(report.duration_s as f64 + 0.1);
    assert!(flight.last.unwrap().position_m.distance(Vec3::new(1.5, 0.0, 0.3)) < 1e-5);
}

#[test]
fn flight_starts_on_the_ground_and_ends_there() {
    let mut flight = CheckedFlight::hovering();
    assert!(!flight.planner.is_landing());
    assert_eq!(flight.planner.touched_down(), Err(PlanError::NotLanding));
    flight.floor_m = -0.1;
    let report = flight.planner.land(flight.now_s, -0.1, Some(3.0)).unwrap();
    assert!(report.duration_s >= 3.0 && !report.is_clamped);
    assert_eq!(flight.planner.land(flight.now_s, 0.0, None), Err(PlanError::Landing));
    flight.run(report.duration_s as f64 + 2.0);
    assert!(flight.planner.is_landing() && !flight.planner.is_idle());
    assert!(flight.last.unwrap().position_m.distance(Vec3::Z * -0.1) < 1e-5);
    assert_eq!(flight.planner.touched_down(), Ok(()));
    assert!(flight.planner.is_idle());
    assert_eq!(flight.planner.reference(flight.now_s + 0.1), None);
    let report = flight.planner.take_off(flight.now_s + 1.0, Vec3::ZERO, 0.0, 5.0, None).unwrap();
    assert!(report.is_clamped);
}

#[test]
fn landing_in_motion_descends_above_the_point_of_the_stop() {
    let mut flight = CheckedFlight::hovering();
    let ahead = VelocityCommand { velocity_m_s: Vec3::X, ..VelocityCommand::STOP };
    flight.planner.follow_velocity(flight.now_s, ahead).unwrap();
    flight.run(0.7);
    flight.floor_m = 0.0;
    flight.planner.land(flight.now_s, 0.0, None).unwrap();
    flight.check_no_jump();
    flight.run(6.0);
    let end = flight.last.unwrap().position_m;
    assert!(end.z.abs() < 1e-4 && end.x > 0.5 && end.x <= 1.5, "{end}");
}

#[test]
fn each_wrong_command_has_its_error() {
    let mut idle = Planner::<2>::new(LIMITS, fence()).unwrap();
    assert_eq!(idle.reference(1.0), None);
    assert_eq!(idle.go_to(1.0, absolute(0.0, 0.0, 1.0), None), Err(PlanError::NotFlying));
    assert_eq!(idle.hover(1.0), Err(PlanError::NotFlying));
    assert_eq!(idle.land(1.0, 0.0, None), Err(PlanError::NotFlying));
    assert_eq!(idle.follow_velocity(1.0, VelocityCommand::STOP), Err(PlanError::NotFlying));
    assert_eq!(idle.follow_trajectory(1.0, &[], false), Err(PlanError::NotFlying));
    assert_eq!(idle.take_off(1.0, Vec3::X * 3.0, 0.0, 1.0, None), Err(PlanError::OutsideFence));
    assert_eq!(idle.take_off(1.0, Vec3::Z * 3.0, 0.0, 4.0, None), Err(PlanError::OutsideFence));
    assert_eq!(idle.take_off(1.0, Vec3::Z * 0.5, 0.0, 0.5, None), Err(PlanError::Height));
    assert_eq!(idle.take_off(1.0, Vec3::NAN, 0.0, 1.0, None), Err(PlanError::NotFinite));
    assert_eq!(idle.take_off(f64::NAN, Vec3::ZERO, 0.0, 1.0, None), Err(PlanError::NotFinite));
    for duration_s in [0.0, -1.0, 2000.0, f32::NAN, f32::INFINITY] {
        let result = idle.take_off(1.0, Vec3::ZERO, 0.0, 1.0, Some(duration_s));
        assert_eq!(result, Err(PlanError::Duration));
    }
    assert!(idle.is_idle());
    let slow = FlightLimits { climb_m_s: 1e-3, ..LIMITS };
    let mut slow = Planner::<1>::new(slow, fence()).unwrap();
    assert_eq!(slow.take_off(1.0, Vec3::ZERO, 0.0, 1.0, None), Err(PlanError::TooFar));
    assert!(slow.take_off(1.0, Vec3::ZERO, 0.0, 0.5, None).is_ok());
    let wrong = FlightLimits { jerk_m_s3: 0.0, ..LIMITS };
    assert_eq!(Planner::<1>::new(wrong, fence()).err(), Some(PlanError::Limits));

    let mut flight = CheckedFlight::hovering();
    let now_s = flight.now_s;
    let planner = &mut flight.planner;
    assert_eq!(planner.take_off(now_s, Vec3::ZERO, 0.0, 1.0, None), Err(PlanError::Flying));
    assert_eq!(planner.go_to(now_s, absolute(f32::NAN, 0.0, 1.0), None), Err(PlanError::NotFinite));
    assert_eq!(planner.go_to(f64::NAN, absolute(0.0, 0.0, 1.0), None), Err(PlanError::NotFinite));
    let wrong = VelocityCommand { yaw_rate_rad_s: f32::NAN, ..VelocityCommand::STOP };
    assert_eq!(planner.follow_velocity(now_s, wrong), Err(PlanError::NotFinite));
    assert_eq!(planner.follow_trajectory(now_s, &[], false), Err(PlanError::NoPiece));
    assert!(planner.is_done());
}

/// Position, velocity, acceleration and jerk on a figure 8 of 2 m x 1 m that takes 8 s, with a
/// start and an end at rest that take 1 s each: (sin θ, sin 2θ / 2) where θ' is a smooth trapezoid.
fn figure_8(t: f64) -> [[f64; 4]; 2] {
    if t > 4.0 {
        // The second half is the first one backwards in time, turned by half a circle about x.
        let [x, y] = figure_8(8.0 - t);
        let reversed = |[p, v, a, j]: [f64; 4]| [-p, v, -a, j];
        return [reversed(x), reversed(y)];
    }
    let rate = core::f64::consts::TAU / 7.0;
    let u = t.min(1.0);
    let ramp = 35.0 * u.powi(4) - 84.0 * u.powi(5) + 70.0 * u.powi(6) - 20.0 * u.powi(7);
    let ramp1 = 140.0 * (u * (1.0 - u)).powi(3);
    let ramp2 = 420.0 * (u * (1.0 - u)).powi(2) * (1.0 - 2.0 * u);
    let integral = 7.0 * u.powi(5) - 14.0 * u.powi(6) + 10.0 * u.powi(7) - 2.5 * u.powi(8);
    let angle = rate * (integral + (t - 1.0).max(0.0));
    let [d1, d2, d3] = [rate * ramp, rate * ramp1, rate * ramp2];
    let axis = |size: f64, n: f64| {
        let (sin, cos) = (n * angle).sin_cos();
        let [f1, f2, f3] = [n * cos, -n * n * sin, -n * n * n * cos];
        [
            size * sin,
            size * f1 * d1,
            size * (f2 * d1 * d1 + f1 * d2),
            size * (f3 * d1 * d1 * d1 + 3.0 * f2 * d1 * d2 + f1 * d3),
        ]
    };
    [axis(1.0, 1.0), axis(0.5, 2.0)]
}

fn figure_8_pieces(count: usize) -> Vec<TrajectoryPiece> {
    let duration = 8.0 / count as f64;
    (0..count)
        .map(|i| {
            let [x0, y0] = figure_8(i as f64 * duration);
            let [x1, y1] = figure_8((i + 1) as f64 * duration);
            let x = solve_with_jerk(x0, x1, duration);
            let y = solve_with_jerk(y0, y1, duration);
            let position = core::array::from_fn(|k| Vec3::new(x[k] as f32, y[k] as f32, 0.0));
            TrajectoryPiece::new(duration as f32, position, [0.0; 8]).unwrap()
        })
        .collect()
}

#[test]
fn figure_8_of_pieces_is_flown_exactly() {
    let mut flight = CheckedFlight::hovering();
    let pieces = figure_8_pieces(16);
    let start_s = flight.now_s;
    let report = flight.planner.follow_trajectory(start_s, &pieces, true).unwrap();
    flight.check_no_jump();
    assert!((report.duration_s - 8.0).abs() < 1e-4);
    let samples = flight.run(8.0);
    let mut worst = 0.0_f32;
    for (i, sample) in samples.iter().enumerate() {
        let [x, y] = figure_8((i + 1) as f64 * STEP_S);
        let exact = Vec3::new(x[0] as f32, y[0] as f32, 1.0);
        worst = worst.max(sample.position_m.distance(exact));
    }
    assert!(worst < 1e-3, "{worst}");
    let mean = samples.iter().map(|r| r.velocity_m_s.length()).sum::<f32>() / samples.len() as f32;
    assert!((mean - 0.75).abs() < 0.02, "{mean}");
    flight.run(0.5);
    assert!(flight.planner.is_done());
    assert!(flight.last.unwrap().position_m.distance(Vec3::Z) < 1e-3);
}

#[test]
fn trajectory_is_left_at_any_moment_without_a_jump() {
    for tenth in 0..80 {
        let mut flight = CheckedFlight::hovering();
        flight.planner.follow_trajectory(flight.now_s, &figure_8_pieces(16), true).unwrap();
        flight.run(tenth as f64 / 10.0);
        match tenth % 3 {
            0 => flight.planner.hover(flight.now_s).unwrap(),
            1 => flight.planner.go_to(flight.now_s, absolute(0.0, 0.5, 1.5), None).unwrap(),
            _ => flight.planner.follow_velocity(flight.now_s, VelocityCommand::STOP).unwrap(),
        };
        flight.check_no_jump();
        flight.run(4.0);
        assert!(flight.last.unwrap().velocity_m_s.length() < 1e-3);
    }
}

/// Returns a piece that moves along x, up to the third power of the time.
fn along_x(duration_s: f32, powers: [f32; 4], yaw: [f32; 2]) -> TrajectoryPiece {
    let mut position = [Vec3::ZERO; 8];
    for (point, power) in position.iter_mut().zip(powers) {
        point.x = power;
    }
    position[0].z = 1.0;
    let yaw = [yaw[0], yaw[1], 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    TrajectoryPiece::new(duration_s, position, yaw).unwrap()
}

#[test]
fn error_names_the_piece_and_its_fault() {
    let still = along_x(1.0, [0.0; 4], [0.0; 2]);
    let rest_to_rest = |x: f64, y: f64, t: f64| {
        let x = solve_with_jerk([0.0; 4], [x, 0.0, 0.0, 0.0], t);
        let y = solve_with_jerk([0.0; 4], [y, 0.0, 0.0, 0.0], t);
        let position = core::array::from_fn(|k| {
            Vec3::new(x[k] as f32, y[k] as f32, if k == 0 { 1.0 } else { 0.0 })
        });
        TrajectoryPiece::new(t as f32, position, [0.0; 8]).unwrap()
    };
    let turn = |angle: f64, t: f64| {
        let yaw = solve_with_jerk([0.0; 4], [angle, 0.0, 0.0, 0.0], t).map(|c| c as f32);
        let mut position = [Vec3::ZERO; 8];
        position[0].z = 1.0;
        TrajectoryPiece::new(t as f32, position, yaw).unwrap()
    };
    let cases = [
        (along_x(1.0, [0.1, 0.0, 0.0, 0.0], [0.0; 2]), PieceFault::Position),
        (along_x(1.0, [0.0, 0.1, 0.0, 0.0], [0.0; 2]), PieceFault::Velocity),
        (along_x(1.0, [0.0, 0.0, 0.2, 0.0], [0.0; 2]), PieceFault::Acceleration),
        (along_x(1.0, [0.0; 4], [0.1, 0.0]), PieceFault::Yaw),
        (along_x(1.0, [0.0; 4], [0.0, 0.1]), PieceFault::Yaw),
        (along_x(0.5, [0.0, 0.0, 0.0, 0.5], [0.0; 2]), PieceFault::EndsInMotion),
        (rest_to_rest(1.4, 0.0, 1.8), PieceFault::SpeedLimit),
        (rest_to_rest(0.4, 0.0, 0.8), PieceFault::AccelerationLimit),
        (rest_to_rest(0.05, 0.0, 0.38), PieceFault::JerkLimit),
        (rest_to_rest(0.0, 1.2, 3.0), PieceFault::Fence),
        (turn(2.0, 1.0), PieceFault::YawRateLimit),
    ];
    for (wrong, fault) in cases {
        let mut flight = CheckedFlight::hovering();
        let result = flight.planner.follow_trajectory(flight.now_s, &[still, wrong], false);
        assert_eq!(result, Err(PlanError::Piece { piece: 1, fault }));
        assert!(flight.planner.is_done());
    }
    let mut flight = CheckedFlight::hovering();
    let many = std::vec![still; 33];
    let result = flight.planner.follow_trajectory(flight.now_s, &many, false);
    assert_eq!(result, Err(PlanError::TooManyPieces));
    assert!(flight.planner.follow_trajectory(flight.now_s, &many[..32], false).is_ok());
}
