//! The complementary filter, which estimates attitude and height without a position.
//!
//! [`ComplementaryFilter`] is the explicit complementary filter with bias correction of Mahony,
//! Hamel and Pflimlin, "Nonlinear Complementary Filters on the Special Orthogonal Group", IEEE
//! Transactions on Automatic Control 53(5), 2008, section V, for one measured direction. With the
//! measured direction of the specific force a, and the same direction v that the estimate predicts:
//!
//! * ω_mes = a × v,
//! * dq/dt = ½ q ⊗ (ω − b + k_P ω_mes),
//! * db/dt = −k_I ω_mes.
//!
//! The filter takes the specific force for the opposite of gravity. That holds on average in hover;
//! a long acceleration in one direction tilts the estimate. Yaw comes from the gyroscope alone, so
//! it drifts, and the bias of the rate about the vertical cannot be observed.
//!
//! [`HeightEstimator`] estimates height and vertical velocity.

mod height;

use glam::{Quat, Vec3};

pub use height::HeightEstimator;

use crate::{GRAVITY_M_S2, ImuSample};

/// Proportional gain k_P in 1/s: errors of the tilt shrink with a time constant of 2.5 s.
///
/// Both gains are those of the Crazyflie's firmware (crazyflie-firmware 2a18fc29, `sensfusion6.c`),
/// which gives the doubled gains 0.8 and 0.002.
pub const PROPORTIONAL_GAIN_1_S: f32 = 0.4;

/// Integral gain k_I in 1/s²: the bias settles with a time constant of 400 s.
pub const INTEGRAL_GAIN_1_S2: f32 = 0.001;

/// Largest bias that the filter estimates on one axis, in rad/s (5.7 °/s).
///
/// Calibration removes the bias before flight. Its later drift with the temperature is below 1 °/s,
/// so a larger estimate is an error of the accelerometer.
pub const MOST_GYRO_BIAS_RAD_S: f32 = 0.1;

/// An estimator of the attitude from the inertial sensors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ComplementaryFilter {
    /// Unit quaternion: rotation from the body frame to the world frame.
    attitude: Quat,
    gyro_bias_rad_s: Vec3,
}

impl Default for ComplementaryFilter {
    fn default() -> Self {
        ComplementaryFilter::new()
    }
}

impl ComplementaryFilter {
    /// Returns a filter that starts level with yaw 0 and without bias.
    pub fn new() -> Self {
        ComplementaryFilter { attitude: Quat::IDENTITY, gyro_bias_rad_s: Vec3::ZERO }
    }

    /// Returns a filter that starts with the given attitude and without bias.
    ///
    /// The attitude need not have unit length. `None` if it is zero or not finite.
    pub fn with_attitude(attitude: Quat) -> Option<Self> {
        let attitude = unit_quaternion(attitude)?;
        Some(ComplementaryFilter { attitude, gyro_bias_rad_s: Vec3::ZERO })
    }

    /// Returns the filter with a known bias of the gyroscope in rad/s, such as from the last flight.
    ///
    /// Each axis is limited to [`MOST_GYRO_BIAS_RAD_S`]. `None` if it is not finite.
    pub fn with_gyro_bias(self, gyro_bias_rad_s: Vec3) -> Option<Self> {
        let most = Vec3::splat(MOST_GYRO_BIAS_RAD_S);
        gyro_bias_rad_s.is_finite().then(|| ComplementaryFilter {
            gyro_bias_rad_s: gyro_bias_rad_s.clamp(-most, most),
            ..self
        })
    }

    /// Processes one sample, which lasts `dt_s` seconds, and returns the new attitude.
    ///
    /// The integration is Euler's with normalization: for a constant rate ω about one axis, a step
    /// turns the attitude by 2·atan(ω·dt/2), 1.3 ppm less than ω·dt at 1 rad/s and 250 Hz.
    ///
    /// A specific force of zero, or one that is not finite, corrects nothing: the gyroscope alone
    /// turns the attitude. A rate or a time that is not finite, or a time of 0 or less, changes
    /// nothing.
    pub fn update(&mut self, imu: &ImuSample, dt_s: f32) -> Quat {
        if !(dt_s > 0.0 && dt_s.is_finite() && imu.gyro_rad_s.is_finite()) {
            return self.attitude;
        }
        let mut gyro_bias_rad_s = self.gyro_bias_rad_s;
        let mut correction_rad_s = Vec3::ZERO;
        if let Some(measured_up) = direction(imu.accel_m_s2) {
            let error = measured_up.cross(self.up_in_body());
            let most = Vec3::splat(MOST_GYRO_BIAS_RAD_S);
            gyro_bias_rad_s =
                (gyro_bias_rad_s - error * (INTEGRAL_GAIN_1_S2 * dt_s)).clamp(-most, most);
            correction_rad_s = error * PROPORTIONAL_GAIN_1_S;
        }
        let rate_rad_s = imu.gyro_rad_s - gyro_bias_rad_s + correction_rad_s;
        let half_angle = rate_rad_s * (0.5 * dt_s);
        let turn = self.attitude * Quat::from_xyzw(half_angle.x, half_angle.y, half_angle.z, 0.0);
        if let Some(attitude) = unit_quaternion(self.attitude + turn) {
            *self = ComplementaryFilter { attitude, gyro_bias_rad_s };
        }
        self.attitude
    }

    /// Returns the rotation from the body frame to the world frame, of unit length.
    pub fn attitude(&self) -> Quat {
        self.attitude
    }

    /// Returns the estimated bias of the gyroscope in rad/s.
    pub fn gyro_bias_rad_s(&self) -> Vec3 {
        self.gyro_bias_rad_s
    }

    /// Returns the acceleration along the world's z axis, without gravity, in m/s².
    ///
    /// The result is not finite if `accel_m_s2` is not finite.
    pub fn vertical_acceleration_m_s2(&self, accel_m_s2: Vec3) -> f32 {
        accel_m_s2.dot(self.up_in_body()) - GRAVITY_M_S2
    }

    /// Returns the world's z axis in the body frame: the third row of the rotation matrix.
    fn up_in_body(&self) -> Vec3 {
        let Quat { x, y, z, w } = self.attitude;
        let up_z = w * w - x * x - y * y + z * z;
        Vec3::new(2.0 * (x * z - w * y), 2.0 * (w * x + y * z), up_z)
    }
}

/// Returns the quaternion with unit length, or `None` if it is zero or not finite.
fn unit_quaternion(q: Quat) -> Option<Quat> {
    let length_squared = q.length_squared();
    let is_usable = length_squared.is_finite() && length_squared >= f32::MIN_POSITIVE;
    is_usable.then(|| q * (1.0 / libm::sqrtf(length_squared)))
}

/// Returns the vector with unit length, or `None` if it is zero or not finite.
fn direction(v: Vec3) -> Option<Vec3> {
    let length_squared = v.length_squared();
    let is_usable = length_squared.is_finite() && length_squared >= f32::MIN_POSITIVE;
    is_usable.then(|| v * (1.0 / libm::sqrtf(length_squared)))
}

#[cfg(test)]
mod tests {
    use glam::{EulerRot, Vec4};
    use proptest::prelude::*;

    use super::*;

    const DT_S: f32 = 0.004;

    /// A sample of a robot that rests or turns about a fixed point.
    fn sample(attitude: Quat, gyro_rad_s: Vec3) -> ImuSample {
        let accel_m_s2 = attitude.inverse() * Vec3::new(0.0, 0.0, GRAVITY_M_S2);
        ImuSample { gyro_rad_s, accel_m_s2 }
    }

    fn tilt_between(a: Quat, b: Quat) -> f32 {
        (a.inverse() * Vec3::Z).angle_between(b.inverse() * Vec3::Z)
    }

    type Vector64 = [f64; 3];

    fn cross(a: Vector64, b: Vector64) -> Vector64 {
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    }

    fn to_f32(v: Vector64) -> Vec3 {
        Vec3::from_array(v.map(|c| c as f32))
    }

    /// The same observer in f64 with a rotation matrix, integrated with the exponential map.
    struct MatrixObserver {
        /// The world's axes in the body frame.
        rows: [Vector64; 3],
        bias: Vector64,
    }

    impl MatrixObserver {
        fn update(&mut self, gyro: Vector64, accel: Vector64, dt: f64) {
            let norm = accel.iter().map(|a| a * a).sum::<f64>().sqrt();
            let error = cross(accel.map(|a| a / norm), self.rows[2]);
            let turn: Vector64 = core::array::from_fn(|i| {
                self.bias[i] -= 0.001 * dt * error[i];
                (gyro[i] - self.bias[i] + 0.4 * error[i]) * dt
            });
            // A vector that is fixed in the world turns by the negative angle in the body frame
            // (Rodrigues' formula).
            let angle = turn.iter().map(|a| a * a).sum::<f64>().sqrt();
            let axis = turn.map(|a| -a / angle.max(1e-300));
            for row in &mut self.rows {
                let side = cross(axis, *row);
                let back = cross(axis, side);
                *row = core::array::from_fn(|i| {
                    row[i] + angle.sin() * side[i] + (1.0 - angle.cos()) * back[i]
                });
            }
        }

        /// Largest difference between an element of the two rotation matrices.
        fn difference_from(&self, attitude: Quat) -> f32 {
            let axes = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| attitude.inverse() * axis);
            let differences = axes.iter().zip(self.rows).map(|(a, b)| (*a - to_f32(b)).abs());
            differences.map(Vec3::max_element).fold(0.0, f32::max)
        }
    }

    #[test]
    fn rotation_about_one_axis_agrees_with_the_closed_form() {
        for axis in [Vec3::X, Vec3::Y, Vec3::Z, Vec3::new(2.0, -1.0, 2.0) / 3.0] {
            for rate in [0.1_f32, 1.0, -6.0] {
                let mut filter = ComplementaryFilter::new();
                let free_fall = ImuSample { gyro_rad_s: axis * rate, accel_m_s2: Vec3::ZERO };
                for _ in 0..250 {
                    filter.update(&free_fall, DT_S);
                }
                let angle = 250.0 * 2.0 * f64::atan(f64::from(rate) * 0.002);
                let (sin, cos) = (0.5 * angle).sin_cos();
                let expected = axis.extend(0.0) * sin as f32 + Vec4::W * cos as f32;
                let error = (Vec4::from(filter.attitude()) - expected).length();
                assert!(error < 1e-5, "{axis} {rate}: {error}");
                // The exact rotation differs by less than 0.001 rad after a second.
                let exact = Quat::from_axis_angle(axis.normalize(), rate);
                assert!(filter.attitude().angle_between(exact) < 1e-3);
            }
        }
    }

    #[test]
    fn positive_rate_about_y_lowers_the_nose() {
        let mut filter = ComplementaryFilter::new();
        for _ in 0..25 {
            filter.update(&ImuSample { gyro_rad_s: Vec3::Y, accel_m_s2: Vec3::ZERO }, DT_S);
        }
        let (yaw, pitch, roll) = filter.attitude().to_euler(EulerRot::ZYX);
        assert!((pitch - 0.1).abs() < 1e-4 && yaw.abs() < 1e-6 && roll.abs() < 1e-6, "{pitch}");
        assert!((filter.attitude() * Vec3::X).z < 0.0);
    }

    #[test]
    fn wrong_start_converges_to_the_true_tilt_as_the_linear_theory_predicts() {
        let truth = Quat::from_euler(EulerRot::ZYX, 0.0, 0.1, 0.0);
        let mut filter = ComplementaryFilter::with_attitude(Quat::IDENTITY).unwrap();
        // k_P alone gives exp(-0.4 t); the integral adds less than 0.2 % of the start in 5 s.
        for step in 1..=1250 {
            filter.update(&sample(truth, Vec3::ZERO), DT_S);
            let expected = 0.1 * libm::expf(-0.4 * step as f32 * DT_S);
            let error = tilt_between(filter.attitude(), truth);
            assert!((error - expected).abs() < 5e-4, "{step}: {error} {expected}");
        }
    }

    #[test]
    fn large_wrong_starts_converge() {
        let truth = Quat::from_euler(EulerRot::ZYX, 1.0, -0.4, 0.3);
        for start in [
            Quat::from_rotation_x(3.0),
            Quat::from_rotation_y(-2.0),
            Quat::from_euler(EulerRot::XYZ, 1.5, 1.5, 0.0),
        ] {
            let mut filter = ComplementaryFilter::with_attitude(start).unwrap();
            for _ in 0..250 * 1800 {
                filter.update(&sample(truth, Vec3::ZERO), DT_S);
            }
            let error = tilt_between(filter.attitude(), truth);
            assert!(error < 2e-3, "{start}: {error}");
        }
    }

    #[test]
    fn gyro_bias_is_estimated_as_the_linear_theory_predicts() {
        let bias = Vec3::new(0.01, -0.02, 0.0);
        let mut filter = ComplementaryFilter::new();
        // Solution of db/dt = k_I e, de/dt = bias - b - k_P e, where e is the error of the tilt.
        let root = (0.4_f64 * 0.4 - 4.0 * 0.001).sqrt();
        let (slow, fast) = (0.5 * (0.4 - root), 0.5 * (0.4 + root));
        for second in 1..=1500_u32 {
            for _ in 0..250 {
                filter.update(&sample(Quat::IDENTITY, bias), DT_S);
            }
            let t = f64::from(second);
            let share = 1.0 - (fast * (-slow * t).exp() - slow * (-fast * t).exp()) / (fast - slow);
            let expected = bias * share as f32;
            let error = filter.gyro_bias_rad_s() - expected;
            assert!(error.length() < 2e-4, "{second} s: {error}");
        }
        assert!((filter.gyro_bias_rad_s() - bias).length() < 1e-3);
        assert!(tilt_between(filter.attitude(), Quat::IDENTITY) < 2e-3);
    }

    #[test]
    fn flight_agrees_with_a_rotation_matrix_in_f64() {
        let mut filter = ComplementaryFilter::new();
        let rows = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let mut observer = MatrixObserver { rows, bias: [0.0; 3] };
        let dt = 0.001;
        for n in 0..20_000 {
            let t = f64::from(n) * dt;
            let gyro = [(3.0 * t).sin(), 0.7 * (2.0 * t).cos(), 0.3 * t.sin()];
            let accel = [(1.3 * t).sin(), (0.7 * t).cos(), 9.81 + (5.0 * t).sin()];
            observer.update(gyro, accel, dt);
            let imu = ImuSample { gyro_rad_s: to_f32(gyro), accel_m_s2: to_f32(accel) };
            let error = observer.difference_from(filter.update(&imu, 0.001));
            assert!(error < 1e-4, "{t} s: {error}");
        }
        assert!((filter.gyro_bias_rad_s() - to_f32(observer.bias)).length() < 1e-5);
    }

    #[test]
    fn vertical_acceleration_excludes_gravity() {
        let truth = Quat::from_euler(EulerRot::ZYX, 0.5, 0.2, -0.3);
        let filter = ComplementaryFilter::with_attitude(truth).unwrap();
        let accel = truth.inverse() * Vec3::new(1.0, -2.0, GRAVITY_M_S2 + 0.5);
        assert!((filter.vertical_acceleration_m_s2(accel) - 0.5).abs() < 1e-5);
    }

    #[test]
    fn invalid_start_is_refused() {
        assert!(ComplementaryFilter::with_attitude(Quat::from_xyzw(0.0, 0.0, 0.0, 0.0)).is_none());
        let nan = Quat::from_xyzw(0.0, f32::NAN, 0.0, 1.0);
        assert!(ComplementaryFilter::with_attitude(nan).is_none());
        let long = ComplementaryFilter::with_attitude(Quat::from_xyzw(0.0, 3.0, 0.0, 4.0)).unwrap();
        assert!((long.attitude().length() - 1.0).abs() < 1e-6);
    }

    #[test]
    fn known_bias_is_subtracted_and_limited() {
        let bias = Vec3::new(0.01, -0.02, 0.03);
        let mut filter = ComplementaryFilter::new().with_gyro_bias(bias).unwrap();
        filter.update(&sample(Quat::IDENTITY, bias), DT_S);
        assert!(filter.attitude().angle_between(Quat::IDENTITY) < 1e-6);
        let filter = filter.with_gyro_bias(Vec3::splat(-1.0)).unwrap();
        assert_eq!(filter.gyro_bias_rad_s(), Vec3::splat(-MOST_GYRO_BIAS_RAD_S));
        assert!(filter.with_gyro_bias(Vec3::NAN).is_none());
    }

    proptest! {
        #[test]
        fn attitude_keeps_unit_length_and_the_bias_its_limit(
            samples in prop::collection::vec(any::<([f32; 3], [f32; 3], f32)>(), 1..50),
        ) {
            let mut filter = ComplementaryFilter::new();
            for (gyro, accel, dt_s) in samples {
                let imu = ImuSample { gyro_rad_s: gyro.into(), accel_m_s2: accel.into() };
                let attitude = filter.update(&imu, dt_s);
                prop_assert!((attitude.length() - 1.0).abs() < 1e-5);
                prop_assert!(filter.gyro_bias_rad_s().abs().max_element() <= MOST_GYRO_BIAS_RAD_S);
            }
        }

        #[test]
        fn invalid_force_leaves_the_gyroscope(
            rate in prop::array::uniform3(-5.0_f32..5.0),
            bad in prop::sample::select(std::vec![0.0, f32::NAN, f32::INFINITY]),
        ) {
            let mut filter = ComplementaryFilter::new();
            let imu = ImuSample { gyro_rad_s: rate.into(), accel_m_s2: Vec3::splat(bad) };
            filter.update(&imu, DT_S);
            let expected = Quat::from_scaled_axis(Vec3::from(rate) * DT_S);
            prop_assert!(filter.attitude().angle_between(expected) < 1e-3);
            prop_assert_eq!(filter.gyro_bias_rad_s(), Vec3::ZERO);
        }

        #[test]
        fn invalid_rate_or_time_changes_nothing(
            bad in prop::sample::select(std::vec![f32::NAN, f32::INFINITY, f32::NEG_INFINITY]),
        ) {
            let mut filter = ComplementaryFilter::new();
            let good = sample(Quat::from_rotation_x(0.1), Vec3::X);
            filter.update(&ImuSample { gyro_rad_s: Vec3::new(0.0, bad, 0.0), ..good }, DT_S);
            filter.update(&good, bad);
            filter.update(&good, 0.0);
            filter.update(&good, -0.001);
            prop_assert_eq!(filter, ComplementaryFilter::new());
        }
    }
}
