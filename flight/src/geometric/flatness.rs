//! Differential flatness: the attitude, body rate and angular acceleration of a planned path.
//!
//! The position and yaw of a quadrotor are flat outputs (Mellinger & Kumar 2011, "Minimum snap
//! trajectory generation and control for quadrotors"). Let a be the thrust per mass in
//! the world frame, s its length, z = a/s, and x_C = (cos ψ, sin ψ, 0). Then y = z × x_C/n with
//! n = |z × x_C|, and x = y × z. The body rate follows from ż = ω × z and from the derivative of y:
//!
//! * ω_x = −ȧ·y/s and ω_y = ȧ·x/s;
//! * n ω_z = ω_x (x_C·z) + ψ̇ (y_C·y), with y_C = (−sin ψ, cos ψ, 0).
//!
//! The second derivative of a = s z gives the angular acceleration (compare Faessler, Franchi &
//! Scaramuzza 2018, "Differential flatness of quadrotor dynamics subject to rotor drag",
//! whose heading convention is another one). The tests compare both with numerical derivatives.

use glam::{Mat3, Vec3};

/// Least thrust per mass in m/s² that has a direction.
const LIFT_M_S2_MIN: f32 = 1e-3;

/// The rotation of a robot and its derivatives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct AttitudeMotion {
    /// Rotation from the body frame to the world frame.
    pub attitude: Mat3,
    /// Angular rate in the body frame in rad/s.
    pub rate_rad_s: Vec3,
    /// Angular acceleration in the body frame in rad/s².
    pub acceleration_rad_s2: Vec3,
}

/// Returns the attitude that gives the thrust per mass `lift_m_s2` and heads to `yaw_rad`, with its
/// derivatives by those of the lift and of the yaw.
///
/// Returns nothing if the lift is about zero, or horizontal along the heading.
pub(super) fn attitude_motion(
    lift_m_s2: Vec3,
    lift_rate_m_s3: Vec3,
    lift_acceleration_m_s4: Vec3,
    yaw_rad: f32,
    yaw_rate_rad_s: f32,
) -> Option<AttitudeMotion> {
    let (sin, cos) = libm::sincosf(yaw_rad);
    let (heading, left) = (Vec3::new(cos, sin, 0.0), Vec3::new(-sin, cos, 0.0));
    let s = lift_m_s2.length();
    let z = lift_m_s2 / s;
    let across = z.cross(heading);
    let n = across.length();
    // The comparison is false for NaN too.
    if !(s > LIFT_M_S2_MIN && n > 1e-3 && s.is_finite()) {
        return None;
    }
    let y = across / n;
    let x = y.cross(z);

    let s_rate = z.dot(lift_rate_m_s3);
    let rate_x = -y.dot(lift_rate_m_s3) / s;
    let rate_y = x.dot(lift_rate_m_s3) / s;
    let slope = heading.dot(z);
    let rate_z = (rate_x * slope + yaw_rate_rad_s * left.dot(y)) / n;

    let acceleration_x =
        -(y.dot(lift_acceleration_m_s4) + 2.0 * s_rate * rate_x) / s + rate_y * rate_z;
    let acceleration_y =
        (x.dot(lift_acceleration_m_s4) - 2.0 * s_rate * rate_y) / s - rate_x * rate_z;
    let slope_rate = yaw_rate_rad_s * left.dot(z) + rate_y * n;
    let y_rate = rate_x * z - rate_z * x;
    let acceleration_z = (acceleration_x * slope
        + rate_x * slope_rate
        + yaw_rate_rad_s * left.dot(y_rate)
        + slope * slope_rate * rate_z / n)
        / n;

    Some(AttitudeMotion {
        attitude: Mat3::from_cols(x, y, z),
        rate_rad_s: Vec3::new(rate_x, rate_y, rate_z),
        acceleration_rad_s2: Vec3::new(acceleration_x, acceleration_y, acceleration_z),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DMat3, DVec3};
    use proptest::prelude::*;

    /// A lift that turns and stretches: value and two derivatives at the time t.
    fn lift(t: f64, phase: f64) -> [DVec3; 3] {
        let (w, v) = (2.0, 3.1);
        let (s, c) = (w * t + phase).sin_cos();
        let (p, q) = (v * t - phase).sin_cos();
        [
            DVec3::new(3.0 * s, 2.0 * q, 9.81 + 1.5 * p),
            DVec3::new(3.0 * w * c, -2.0 * v * p, 1.5 * v * q),
            DVec3::new(-3.0 * w * w * s, -2.0 * v * v * q, -1.5 * v * v * p),
        ]
    }

    /// The attitude in f64 straight from its definition.
    fn attitude(lift: DVec3, yaw: f64) -> DMat3 {
        let z = lift.normalize();
        let y = z.cross(DVec3::new(yaw.cos(), yaw.sin(), 0.0)).normalize();
        DMat3::from_cols(y.cross(z), y, z)
    }

    /// The body rate by central differences of the attitude.
    fn numerical_rate(t: f64, phase: f64, yaw_rate: f64) -> DVec3 {
        let h = 1e-5;
        let at = |t: f64| attitude(lift(t, phase)[0], yaw_rate * t);
        let skew = at(t).transpose() * ((at(t + h) - at(t - h)) * (0.5 / h));
        DVec3::new(skew.y_axis.z, skew.z_axis.x, skew.x_axis.y)
    }

    proptest! {
        #[test]
        fn derivatives_agree_with_differences(
            t in 0.0_f64..6.0, phase in 0.0_f64..6.0, yaw_rate in -2.0_f64..2.0
        ) {
            let [a, a_rate, a_acceleration] = lift(t, phase);
            let motion = attitude_motion(
                a.as_vec3(),
                a_rate.as_vec3(),
                a_acceleration.as_vec3(),
                (yaw_rate * t) as f32,
                yaw_rate as f32,
            )
            .unwrap();
            let rotation = attitude(a, yaw_rate * t);
            let difference = motion.attitude - rotation.as_mat3();
            prop_assert!(difference.to_cols_array().iter().all(|entry| entry.abs() < 1e-5));
            let rate = numerical_rate(t, phase, yaw_rate);
            prop_assert!((motion.rate_rad_s.as_dvec3() - rate).length() < 1e-4);
            let h = 1e-4;
            let acceleration = (numerical_rate(t + h, phase, yaw_rate)
                - numerical_rate(t - h, phase, yaw_rate))
                * (0.5 / h);
            let error = motion.acceleration_rad_s2.as_dvec3() - acceleration;
            prop_assert!(error.length() < 2e-3, "{error}");
        }
    }

    #[test]
    fn lifts_without_an_attitude_are_refused() {
        let none = |lift| attitude_motion(lift, Vec3::ZERO, Vec3::ZERO, 0.0, 0.0).is_none();
        assert!(none(Vec3::ZERO));
        assert!(none(Vec3::new(9.0, 0.0, 0.0)));
        assert!(none(Vec3::NAN));
        assert!(none(Vec3::INFINITY));
    }
}
