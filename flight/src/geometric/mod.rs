//! Geometric tracking control on SE(3) with feed-forward.
//!
//! The law is that of Lee, Leok & McClamroch 2010, "Geometric tracking control of a quadrotor UAV
//! on SE(3)" (49th IEEE CDC), in terms of accelerations:
//!
//! * lift a = ẍ_d + g e₃ + k_x e_x + k_v e_v + i_x, with errors e_x = x_d − x and e_v = ẋ_d − ẋ;
//! * thrust f = m a·R e₃;
//! * torque M = J(−k_R e_R − k_Ω e_Ω − i_R) + Ω × JΩ − J(Ω × Ω_r − Ω̇_r),
//!   with e_R = ½(R_dᵀR − RᵀR_d)^∨, Ω_r = RᵀR_d Ω_d, e_Ω = Ω − Ω_r and Ω̇_r = RᵀR_d Ω̇_d.
//!
//! The desired attitude, its rate and its acceleration follow from the lift, the jerk, the snap and
//! the yaw (`flatness.rs`). The gyroscopic torque of the rotors is left out.
//!
//! # Integrals
//! Both integrals act on a sum of error and rate of error, as in Goodarzi, Lee & Leok 2013,
//! "Geometric nonlinear PID control of a quadrotor UAV on SE(3)". With the ratio of the
//! proportional gains, the integral adds up the acceleration that the feedback commands. That sum
//! is the change of velocity, so any move from rest to rest leaves it unchanged, and only what the
//! model does not explain, such as a thrust 5 % too low, charges it. So a step does not overshoot
//! by the integral.
//! Anti-windup: where a limit shortens the commanded acceleration, the integral of position takes
//! the same share of its input; where the mixer cuts, the integral may not grow
//! ([`GeometricController::note_mixing`]); both integrals are bounded.

mod flatness;
mod settings;
#[cfg(test)]
mod tests;

use glam::{Mat3, Quat, Vec3};

use crate::bounds::{at_least, at_most, within};
use crate::mixer::MixerOutcome;
use crate::{FlightState, GRAVITY_M_S2, Reference, Vehicle, Wrench};
use flatness::{AttitudeMotion, attitude_motion};
pub use settings::GeometricSettings;

/// Error of the rate about x and y in rad/s from which the rate gain grows.
const SWING_RAD_S: f32 = 2.0;
/// Longest step in seconds that the integrals follow.
const STEP_S_MAX: f32 = 0.05;

/// An attitude to hold, with a thrust that does not depend on the position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AttitudeTarget {
    /// Rotation from the body frame to the world frame.
    pub attitude: Quat,
    /// Rate of the turn about the world's z axis, in rad/s.
    pub yaw_rate_rad_s: f32,
    /// Thrust of all motors together in N.
    pub thrust_n: f32,
}

impl AttitudeTarget {
    /// Returns the level attitude that has the yaw of the state.
    pub fn level(state: &FlightState, thrust_n: f32) -> Self {
        let Quat { x, y, z, w } = state.attitude;
        let yaw = libm::atan2f(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z);
        AttitudeTarget { attitude: Quat::from_rotation_z(yaw), yaw_rate_rad_s: 0.0, thrust_n }
    }
}

/// The controller of one vehicle; see the module for the law.
///
/// Call it at 500 Hz with the latest state and reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GeometricController {
    mass_kg: f32,
    inertia_kg_m2: Vec3,
    settings: GeometricSettings,
    /// Largest horizontal lift per vertical lift; infinite without a limit.
    most_slope: f32,
    /// Acceleration by the integral of position in m/s².
    lift_integral_m_s2: Vec3,
    /// Angular acceleration by the integral of attitude in rad/s².
    torque_integral_rad_s2: Vec3,
    /// Direction of the body's z axis in the world that the last call wanted.
    wanted_up: Vec3,
    is_thrust_cut: bool,
    is_tilt_cut: bool,
    is_yaw_cut: bool,
}

impl GeometricController {
    /// Creates a controller with empty integrals.
    pub fn new(vehicle: &Vehicle, settings: GeometricSettings) -> Self {
        GeometricController {
            mass_kg: vehicle.mass_kg,
            inertia_kg_m2: vehicle.inertia_kg_m2,
            most_slope: most_slope(&settings),
            settings,
            lift_integral_m_s2: Vec3::ZERO,
            torque_integral_rad_s2: Vec3::ZERO,
            wanted_up: Vec3::Z,
            is_thrust_cut: false,
            is_tilt_cut: false,
            is_yaw_cut: false,
        }
    }

    /// Empties the integrals, as before take-off.
    pub fn reset(&mut self) {
        self.lift_integral_m_s2 = Vec3::ZERO;
        self.torque_integral_rad_s2 = Vec3::ZERO;
        self.note_mixing(&MixerOutcome::default());
    }

    /// Returns the direction of the body's z axis in the world that the last call wanted.
    pub const fn wanted_up(&self) -> Vec3 {
        self.wanted_up
    }

    /// Returns the thrust in N that the controller believes to keep the height.
    pub fn hover_thrust_n(&self) -> f32 {
        self.mass_kg * (GRAVITY_M_S2 + self.lift_integral_m_s2.z)
    }

    /// Fills the vertical integral so that [`Self::hover_thrust_n`] is the given thrust in N.
    ///
    /// A thrust from an earlier flight avoids the sink after take-off. Limits of the integral hold;
    /// a number that is not finite is ignored.
    pub fn preset_hover_thrust_n(&mut self, thrust_n: f32) {
        let extra = thrust_n / self.mass_kg - GRAVITY_M_S2;
        if extra.is_finite() {
            let limit = self.settings.integral_limit_m_s2.z;
            self.lift_integral_m_s2.z = within(extra, -limit, limit);
        }
    }

    /// Takes the report of the mixer on the last wrench, for the anti-windup.
    pub fn note_mixing(&mut self, outcome: &MixerOutcome) {
        self.is_thrust_cut = outcome.is_thrust_cut || outcome.is_refused;
        self.is_tilt_cut = outcome.is_tilt_cut || outcome.is_refused;
        self.is_yaw_cut = outcome.is_yaw_cut || outcome.is_refused;
    }

    /// Returns the wrench that follows the reference; `dt_s` is the time since the last call.
    ///
    /// A reference that is not finite counts as a hover at the present position and yaw. A state
    /// that is not finite gives a wrench of zero. The thrust can be negative if the robot is upside
    /// down.
    pub fn update(&mut self, state: &FlightState, reference: &Reference, dt_s: f32) -> Wrench {
        let Some(attitude) = rotation(state) else {
            return Wrench::default();
        };
        let reference = finite_or_hover(reference, state);
        let dt_s = valid_step(dt_s);
        let settings = self.settings;
        let drag = settings.drag_1_s;

        // The drag that the plan meets, and its derivatives, belong to the feed-forward.
        let planned =
            reference.acceleration_m_s2 + drag * reference.velocity_m_s + GRAVITY_M_S2 * Vec3::Z;
        let planned_rate = reference.jerk_m_s3 + drag * reference.acceleration_m_s2;
        let planned_acceleration = reference.snap_m_s4 + drag * reference.jerk_m_s3;

        let position_error = (reference.position_m - state.position_m)
            .clamp_length_max(settings.position_error_limit_m);
        let velocity_error = reference.velocity_m_s - state.velocity_m_s;
        let feedback =
            settings.position_1_s2 * position_error + settings.velocity_1_s * velocity_error;
        let wanted = planned + feedback + self.lift_integral_m_s2;
        let lift = limit_lift(&settings, self.most_slope, wanted);
        let charge = settings.position_integral_1_s3 * position_error
            + settings.velocity_integral_1_s2 * velocity_error;
        let followed = lift - planned - self.lift_integral_m_s2;
        self.charge_lift(charge * followed_share(followed, feedback), dt_s);

        let up = attitude.z_axis;
        let lead = settings.thrust_lag_s * planned_rate.dot(up);
        let thrust_n = self.mass_kg * (lift.dot(up) + lead);
        let motion = attitude_motion(
            lift,
            planned_rate,
            planned_acceleration,
            near_yaw(attitude, reference.yaw_rad, settings.most_yaw_error_rad),
            reference.yaw_rate_rad_s,
        );
        // Without a direction of the lift, the present attitude is as good as any.
        let motion = motion.unwrap_or(AttitudeMotion {
            attitude,
            rate_rad_s: Vec3::ZERO,
            acceleration_rad_s2: Vec3::ZERO,
        });
        Wrench { thrust_n, torque_n_m: self.torque(attitude, state.rate_rad_s, &motion, dt_s) }
    }

    /// Returns the wrench that holds an attitude, without the position loop.
    ///
    /// The integral of position keeps its value. A state or target that is not finite gives zero.
    pub fn hold_attitude(
        &mut self,
        state: &FlightState,
        target: &AttitudeTarget,
        dt_s: f32,
    ) -> Wrench {
        let desired = FlightState { attitude: target.attitude, ..*state };
        let (Some(attitude), Some(desired)) = (rotation(state), rotation(&desired)) else {
            return Wrench::default();
        };
        if !(target.yaw_rate_rad_s.is_finite() && target.thrust_n.is_finite()) {
            return Wrench::default();
        }
        let motion = AttitudeMotion {
            attitude: desired,
            rate_rad_s: desired.transpose() * (target.yaw_rate_rad_s * Vec3::Z),
            acceleration_rad_s2: Vec3::ZERO,
        };
        let torque_n_m = self.torque(attitude, state.rate_rad_s, &motion, valid_step(dt_s));
        Wrench { thrust_n: target.thrust_n, torque_n_m }
    }

    /// Returns the torque of the attitude loop, and charges its integral.
    fn torque(&mut self, attitude: Mat3, rate: Vec3, desired: &AttitudeMotion, dt_s: f32) -> Vec3 {
        let settings = self.settings;
        self.wanted_up = desired.attitude.z_axis;
        let to_body = attitude.transpose() * desired.attitude;
        // The axis of the antisymmetric part of R_dᵀR.
        let attitude_error = 0.5
            * Vec3::new(
                to_body.z_axis.y - to_body.y_axis.z,
                to_body.x_axis.z - to_body.z_axis.x,
                to_body.y_axis.x - to_body.x_axis.y,
            );
        let desired_rate = to_body * desired.rate_rad_s;
        let rate_error = rate - desired_rate;
        let charge = settings.attitude_integral_1_s3 * attitude_error
            + settings.rate_integral_1_s2 * rate_error;
        let is_cut = [self.is_tilt_cut, self.is_tilt_cut, self.is_yaw_cut];
        self.torque_integral_rad_s2 = charged(
            self.torque_integral_rad_s2,
            charge * dt_s,
            settings.integral_limit_rad_s2,
            is_cut,
        );
        let swing_rad_s = at_least(rate_error.truncate().length() - SWING_RAD_S, 0.0);
        let growth = 1.0 + settings.swing_growth_s * swing_rad_s;
        let feedback = settings.attitude_1_s2 * attitude_error
            + settings.rate_1_s * rate_error * growth
            + self.torque_integral_rad_s2;
        let forward = to_body * desired.acceleration_rad_s2 - rate.cross(desired_rate);
        let j = self.inertia_kg_m2;
        j * (forward - feedback) + rate.cross(j * rate)
    }

    fn charge_lift(&mut self, charge: Vec3, dt_s: f32) {
        self.lift_integral_m_s2 = charged(
            self.lift_integral_m_s2,
            charge * dt_s,
            self.settings.integral_limit_m_s2,
            [self.is_tilt_cut, self.is_tilt_cut, self.is_thrust_cut],
        );
    }
}

/// Returns the integral after a charge. Each part stays within its limit, and where the actuator is
/// cut it does not grow in magnitude.
fn charged(integral: Vec3, charge: Vec3, limit: Vec3, is_cut: [bool; 3]) -> Vec3 {
    let mut parts = integral.to_array();
    for (((part, charge), limit), is_cut) in
        parts.iter_mut().zip(charge.to_array()).zip(limit.to_array()).zip(is_cut)
    {
        let next = within(*part + charge, -limit, limit);
        if next.is_finite() && !(is_cut && next.abs() > part.abs()) {
            *part = next;
        }
    }
    Vec3::from_array(parts)
}

/// Returns the part of each component of `wanted` that `followed` has, within 0 and 1.
fn followed_share(followed: Vec3, wanted: Vec3) -> Vec3 {
    let part = |followed: f32, wanted: f32| {
        // Differences of this size are rounding.
        if (followed - wanted).abs() < 1e-4 { 1.0 } else { (followed / wanted).clamp(0.0, 1.0) }
    };
    Vec3::new(part(followed.x, wanted.x), part(followed.y, wanted.y), part(followed.z, wanted.z))
}

/// Returns the largest horizontal lift per vertical lift that the tilt allows.
fn most_slope(settings: &GeometricSettings) -> f32 {
    let is_limited = settings.most_tilt_rad < core::f32::consts::FRAC_PI_2;
    if is_limited { libm::tanf(settings.most_tilt_rad) } else { f32::INFINITY }
}

/// Returns the lift within the limits: the vertical part comes first, because height is safety.
fn limit_lift(settings: &GeometricSettings, most_slope: f32, lift: Vec3) -> Vec3 {
    let vertical = within(lift.z, settings.least_lift_m_s2, settings.most_lift_m_s2);
    let horizontal = lift.truncate();
    let mut most = f32::INFINITY;
    if most_slope.is_finite() {
        most = at_least(vertical, 0.0) * most_slope;
    }
    if settings.most_lift_m_s2.is_finite() {
        let rest = settings.most_lift_m_s2 * settings.most_lift_m_s2 - vertical * vertical;
        most = at_most(libm::sqrtf(at_least(rest, 0.0)), most);
    }
    let length = horizontal.length();
    let scale = if length > most { most / length } else { 1.0 };
    (horizontal * scale).extend(vertical)
}

/// Returns the yaw in rad, moved to at most this distance from the yaw of the attitude.
fn near_yaw(attitude: Mat3, yaw_rad: f32, most_error_rad: f32) -> f32 {
    if most_error_rad >= core::f32::consts::PI {
        return yaw_rad;
    }
    let ahead = attitude.x_axis;
    let (sin, cos) = libm::sincosf(yaw_rad);
    let error = libm::atan2f(sin * ahead.x - cos * ahead.y, cos * ahead.x + sin * ahead.y);
    yaw_rad - error + within(error, -most_error_rad, most_error_rad)
}

/// Returns the rotation of a state, or nothing if the state is not finite.
fn rotation(state: &FlightState) -> Option<Mat3> {
    let length = state.attitude.length();
    let is_valid = state.position_m.is_finite()
        && state.velocity_m_s.is_finite()
        && state.rate_rad_s.is_finite()
        && length.is_finite()
        && length > 0.5;
    is_valid.then(|| Mat3::from_quat(state.attitude * (1.0 / length)))
}

/// Returns the reference, or a hover at the state's position and yaw if it is not finite.
fn finite_or_hover(reference: &Reference, state: &FlightState) -> Reference {
    let is_finite = reference.position_m.is_finite()
        && reference.velocity_m_s.is_finite()
        && reference.acceleration_m_s2.is_finite()
        && reference.jerk_m_s3.is_finite()
        && reference.snap_m_s4.is_finite()
        && reference.yaw_rad.is_finite()
        && reference.yaw_rate_rad_s.is_finite();
    if is_finite {
        return *reference;
    }
    let Quat { x, y, z, w } = state.attitude;
    Reference {
        position_m: state.position_m,
        yaw_rad: libm::atan2f(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z),
        ..Reference::default()
    }
}

/// Returns a step that the integrals can use.
fn valid_step(dt_s: f32) -> f32 {
    if dt_s.is_finite() { dt_s.clamp(0.0, STEP_S_MAX) } else { 0.0 }
}
