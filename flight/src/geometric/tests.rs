//! Tests of the law against matrices in f64, inverse dynamics and closed forms.

use super::*;
use glam::{DMat3, DVec3};
use proptest::prelude::*;

/// A Crazyflie with the moments of inertia that Bitcraze's gains belong to.
fn vehicle() -> Vehicle {
    Vehicle {
        inertia_kg_m2: GeometricSettings::BITCRAZE_LEE_INERTIA_KG_M2,
        ..Vehicle::CRAZYFLIE_2_1_PLUS
    }
}

fn controller() -> GeometricController {
    GeometricController::new(&vehicle(), GeometricSettings::BITCRAZE_LEE)
}

fn hat(v: DVec3) -> DMat3 {
    DMat3::from_cols(
        DVec3::new(0.0, v.z, -v.y),
        DVec3::new(-v.z, 0.0, v.x),
        DVec3::new(v.y, -v.x, 0.0),
    )
}

fn vee(m: DMat3) -> DVec3 {
    DVec3::new(m.y_axis.z, m.z_axis.x, m.x_axis.y)
}

/// Lee, Leok & McClamroch 2010, for a reference with constant yaw and no jerk,
/// with Bitcraze's gains as torques, and the integral of attitude after one step.
fn dense_law(state: &FlightState, reference: &Reference, dt: f64) -> (f64, DVec3) {
    let mass = f64::from(vehicle().mass_kg);
    let j = DMat3::from_diagonal(DVec3::new(16.5717e-6, 16.6556e-6, 29.2617e-6));
    let q = state.attitude;
    let (x, y, z, w) = (f64::from(q.x), f64::from(q.y), f64::from(q.z), f64::from(q.w));
    let r = DMat3::from_quat(glam::DQuat::from_xyzw(x, y, z, w).normalize());
    let rate = state.rate_rad_s.as_dvec3();
    let e_x = state.position_m.as_dvec3() - reference.position_m.as_dvec3();
    let e_v = state.velocity_m_s.as_dvec3() - reference.velocity_m_s.as_dvec3();
    let force =
        mass * (-7.0 * e_x - 4.0 * e_v + 9.81 * DVec3::Z + reference.acceleration_m_s2.as_dvec3());
    let yaw = f64::from(reference.yaw_rad);
    let b3 = force.normalize();
    let b2 = b3.cross(DVec3::new(yaw.cos(), yaw.sin(), 0.0)).normalize();
    let r_d = DMat3::from_cols(b2.cross(b3), b2, b3);
    let e_r = 0.5 * vee(r_d.transpose() * r - r.transpose() * r_d);
    let torque = -DVec3::new(0.007, 0.007, 0.008) * e_r
        - DVec3::new(0.00115, 0.00115, 0.002) * rate
        - 0.03 * e_r * dt
        + hat(rate) * (j * rate);
    (force.dot(r * DVec3::Z), torque)
}

fn any_vec3(most: f32) -> impl Strategy<Value = Vec3> {
    prop::array::uniform3(-most..most).prop_map(Vec3::from_array)
}

prop_compose! {
    fn any_state()(
        position_m in any_vec3(1.0),
        velocity_m_s in any_vec3(1.0),
        axis in any_vec3(1.5),
        rate_rad_s in any_vec3(5.0),
    ) -> FlightState {
        FlightState { position_m, velocity_m_s, attitude: Quat::from_scaled_axis(axis), rate_rad_s }
    }
}

/// A path with all derivatives at the time t, the yaw included.
fn path(t: f64) -> ([DVec3; 5], f64) {
    let wave = |order: i32| {
        let sine = |w: f64, phase: f64| {
            w.powi(order) * (w * t + phase + f64::from(order) * std::f64::consts::FRAC_PI_2).sin()
        };
        DVec3::new(0.8 * sine(1.7, 0.0), 0.6 * sine(2.1, 1.0), 0.3 * sine(2.6, 2.0))
    };
    ([0, 1, 2, 3, 4].map(wave), 0.9 * t)
}

/// The attitude along the path, from the definition in f64.
fn path_attitude(t: f64) -> DMat3 {
    let (derivatives, yaw) = path(t);
    let z = (derivatives[2] + 9.81 * DVec3::Z).normalize();
    let y = z.cross(DVec3::new(yaw.cos(), yaw.sin(), 0.0)).normalize();
    DMat3::from_cols(y.cross(z), y, z)
}

fn path_rate(t: f64) -> DVec3 {
    let h = 1e-5;
    let change = (path_attitude(t + h) - path_attitude(t - h)) * (0.5 / h);
    vee(path_attitude(t).transpose() * change)
}

proptest! {
    #[test]
    fn law_agrees_with_matrices(
        state in any_state(),
        position_m in any_vec3(1.0),
        acceleration_m_s2 in any_vec3(3.0),
        yaw_rad in -3.0_f32..3.0,
    ) {
        let reference =
            Reference { position_m, acceleration_m_s2, yaw_rad, ..Reference::default() };
        let wrench = controller().update(&state, &reference, 0.002);
        let (thrust, torque) = dense_law(&state, &reference, f64::from(0.002_f32));
        prop_assert!((f64::from(wrench.thrust_n) - thrust).abs() < 1e-5, "{wrench:?} {thrust}");
        let error = (wrench.torque_n_m.as_dvec3() - torque).length();
        prop_assert!(error < 1e-7, "{wrench:?} {torque}");
    }

    /// On the path, the wrench is that of the Newton-Euler equations, with derivatives of the
    /// attitude by differences.
    #[test]
    fn feed_forward_is_the_inverse_dynamics(t in 0.0_f64..10.0) {
        let (derivatives, yaw) = path(t);
        let [position_m, velocity_m_s, acceleration_m_s2, jerk_m_s3, snap_m_s4] =
            derivatives.map(|derivative| derivative.as_vec3());
        let reference = Reference {
            position_m,
            velocity_m_s,
            acceleration_m_s2,
            jerk_m_s3,
            snap_m_s4,
            yaw_rad: yaw as f32,
            yaw_rate_rad_s: 0.9,
        };
        let rate = path_rate(t);
        let state = FlightState {
            position_m,
            velocity_m_s,
            attitude: Quat::from_mat3(&path_attitude(t).as_mat3()),
            rate_rad_s: rate.as_vec3(),
        };
        let h = 1e-4;
        let rate_change = (path_rate(t + h) - path_rate(t - h)) * (0.5 / h);
        let j = vehicle().inertia_kg_m2.as_dvec3();
        let torque = j * rate_change + rate.cross(j * rate);
        let thrust =
            f64::from(vehicle().mass_kg) * (derivatives[2] + 9.81 * DVec3::Z).length();
        let wrench = controller().update(&state, &reference, 0.0);
        prop_assert!((f64::from(wrench.thrust_n) - thrust).abs() < 1e-5);
        let error = (wrench.torque_n_m.as_dvec3() - torque).length();
        // 1e-6 N·m is 0.4 mrad of attitude times the gain, the rounding of f32 included.
        prop_assert!(error < 1e-6, "{wrench:?} {torque}");
    }

    #[test]
    fn limits_of_the_lift_hold(wanted in any_vec3(60.0)) {
        let settings = GeometricSettings::CRAZYFLIE_2_1_PLUS;
        let lift = limit_lift(&settings, most_slope(&settings), wanted);
        prop_assert!(lift.z >= settings.least_lift_m_s2);
        prop_assert!(lift.length() <= settings.most_lift_m_s2 * 1.0001);
        prop_assert!(lift.angle_between(Vec3::Z) <= settings.most_tilt_rad + 1e-3);
        prop_assert!(lift.truncate().perp_dot(wanted.truncate()).abs() < 1e-2);
    }

    #[test]
    fn integrals_stay_within_their_limits(
        states in prop::collection::vec((any_state(), any_vec3(3.0), any::<f32>()), 1..100)
    ) {
        let settings = GeometricSettings::CRAZYFLIE_2_1_PLUS;
        let mut controller = GeometricController::new(&vehicle(), settings);
        for (state, position_m, dt) in states {
            let reference = Reference { position_m, ..Reference::default() };
            let wrench = controller.update(&state, &reference, dt);
            prop_assert!(wrench.thrust_n.is_finite() && wrench.torque_n_m.is_finite());
            let lift = controller.lift_integral_m_s2.abs();
            prop_assert!(lift.cmple(settings.integral_limit_m_s2).all());
            let torque = controller.torque_integral_rad_s2.abs();
            prop_assert!(torque.cmple(settings.integral_limit_rad_s2).all());
        }
    }
}

#[test]
fn hover_needs_the_weight_alone() {
    let wrench = controller().update(&FlightState::default(), &Reference::default(), 0.002);
    assert!((wrench.thrust_n - vehicle().mass_kg * GRAVITY_M_S2).abs() < 1e-6);
    assert_eq!(wrench.torque_n_m, Vec3::ZERO);
}

/// For a turn by θ about an axis, e_R is sin θ times the axis.
#[test]
fn attitude_error_is_the_sine_of_the_angle() {
    let axis = Vec3::new(2.0, -1.0, 2.0) / 3.0;
    for angle in [0.1_f32, 1.0, 2.0] {
        let state =
            FlightState { attitude: Quat::from_axis_angle(axis, angle), ..FlightState::default() };
        let target =
            AttitudeTarget { attitude: Quat::IDENTITY, yaw_rate_rad_s: 0.0, thrust_n: 0.3 };
        let wrench = controller().hold_attitude(&state, &target, 0.0);
        let expected = -Vec3::new(0.007, 0.007, 0.008) * axis * angle.sin();
        assert!((wrench.torque_n_m - expected).length() < 1e-8);
        assert_eq!(wrench.thrust_n, 0.3);
    }
}

#[test]
fn level_target_keeps_the_yaw() {
    let state = FlightState {
        attitude: Quat::from_rotation_z(2.0) * Quat::from_rotation_y(0.4),
        ..FlightState::default()
    };
    let target = AttitudeTarget::level(&state, 0.3);
    assert!(target.attitude.angle_between(Quat::from_rotation_z(2.0)) < 1e-3);
}

#[test]
fn numbers_that_are_not_finite_are_harmless() {
    let mut controller = controller();
    let before = controller;
    let state = FlightState { velocity_m_s: Vec3::NAN, ..FlightState::default() };
    assert_eq!(controller.update(&state, &Reference::default(), 0.002), Wrench::default());
    let state = FlightState { attitude: Quat::from_xyzw(0.0, 0.0, 0.0, 0.0), ..state };
    let level = AttitudeTarget { attitude: Quat::IDENTITY, yaw_rate_rad_s: 0.0, thrust_n: 0.3 };
    assert_eq!(controller.hold_attitude(&state, &level, 0.002), Wrench::default());
    let level = AttitudeTarget { thrust_n: f32::NAN, ..level };
    let state = FlightState::default();
    assert_eq!(controller.hold_attitude(&state, &level, 0.002), Wrench::default());
    // A broken reference means hover here: the weight, and no torque.
    let state = FlightState { position_m: Vec3::new(5.0, 6.0, 7.0), ..state };
    let reference = Reference { jerk_m_s3: Vec3::NAN, ..Reference::default() };
    let wrench = controller.update(&state, &reference, f32::NAN);
    assert!((wrench.thrust_n - vehicle().mass_kg * GRAVITY_M_S2).abs() < 1e-6);
    assert_eq!(controller, before);
    controller.preset_hover_thrust_n(f32::NAN);
    assert_eq!(controller, before);
}

/// While the mixer cuts, the integral does not grow, but it may shrink.
#[test]
fn cut_thrust_stops_the_vertical_integral() {
    let settings = GeometricSettings::CRAZYFLIE_2_1_PLUS;
    let mut controller = GeometricController::new(&vehicle(), settings);
    let above = Reference { position_m: Vec3::new(0.0, 0.0, 0.1), ..Reference::default() };
    let below = Reference { position_m: Vec3::new(0.0, 0.0, -0.1), ..Reference::default() };
    let state = FlightState::default();
    controller.update(&state, &above, 0.01);
    let charged = controller.hover_thrust_n();
    assert!(charged > vehicle().mass_kg * GRAVITY_M_S2);
    controller.note_mixing(&MixerOutcome { is_thrust_cut: true, ..MixerOutcome::default() });
    controller.update(&state, &above, 0.01);
    assert_eq!(controller.hover_thrust_n(), charged);
    controller.update(&state, &below, 0.005);
    assert!(controller.hover_thrust_n() < charged);
}

#[test]
fn preset_hover_thrust_is_used() {
    let settings = GeometricSettings::CRAZYFLIE_2_1_PLUS;
    let mut controller = GeometricController::new(&vehicle(), settings);
    let thrust_n = 1.05 * vehicle().mass_kg * GRAVITY_M_S2;
    controller.preset_hover_thrust_n(thrust_n);
    let wrench = controller.update(&FlightState::default(), &Reference::default(), 0.002);
    assert!((wrench.thrust_n - thrust_n).abs() < 1e-6);
    controller.reset();
    assert!((controller.hover_thrust_n() - vehicle().mass_kg * GRAVITY_M_S2).abs() < 1e-6);
}

/// Yaw 2 rad away is pursued as if it were 0.5 rad away, on either side and across ±π.
#[test]
fn yaw_errors_are_bounded() {
    for yaw in [-3.0_f32, 0.0, 1.0, 3.0] {
        let attitude = Mat3::from_rotation_z(yaw);
        for error in [-2.0_f32, -0.3, 0.0, 0.4, 2.0] {
            let found = near_yaw(attitude, yaw + error, 0.5) - yaw;
            assert!((found - error.clamp(-0.5, 0.5)).abs() < 1e-5, "{yaw} {error} {found}");
        }
        let across = near_yaw(attitude, yaw + 0.3 + core::f32::consts::TAU, 0.5);
        let (sin, cos) = libm::sincosf(across - yaw);
        assert!((libm::atan2f(sin, cos) - 0.3).abs() < 1e-5);
    }
}
