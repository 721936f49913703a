//! The linear map that carries the error of the state over one prediction.

use glam::{Mat3, Vec3};

use super::config::Linearization;
use super::states::STATES;
use crate::GRAVITY_M_S2;

/// The motion during one prediction, which the map is linearized about.
#[derive(Clone, Copy, Debug)]
pub(super) struct Motion {
    /// Rotation from the body frame to the world frame at the start.
    pub rotation: Mat3,
    /// Velocity in the body frame at the start, in m/s.
    pub velocity_m_s: Vec3,
    /// Integral of the angular rate, in rad.
    pub turn_rad: Vec3,
    /// Integral of the specific force that the model uses, in m/s.
    pub impulse_m_s: Vec3,
    /// Linear drag along each body axis, in 1/s.
    pub drag_per_s: Vec3,
    /// Duration in seconds.
    pub seconds: f32,
}

/// The Jacobian of one prediction, kept as the blocks that differ from zero and one.
///
/// The model in the body frame (Mueller, Hamer and D'Andrea 2015, section III) is ṗ = R·v and
/// v̇ = a·e₃ − ω×v − g·Rᵀe₃ − B·v. With the error d of the attitude, R·exp(d), the error of each
/// part after T seconds is:
/// * position: p + R·T·(v + d×v̄ − e₃·z·T/2), with v̄ the mean velocity and z the bias of the accelerometer;
/// * velocity: (turn − B·T)·v + turn·(d×(g·T·Rᵀe₃)) + b×(T·v̂) − e₃·T·z, with b the bias of the
///   gyroscope; the second turn is absent from the half-angle form;
/// * attitude: turn·d − T·b.
#[derive(Clone, Copy, Debug)]
pub(super) struct Transition {
    position_by_velocity: Mat3,
    mean_velocity: Vec3,
    velocity_turn: Mat3,
    gravity: Vec3,
    travel: Vec3,
    attitude_turn: Mat3,
    form: Linearization,
    seconds: f32,
}

/// Returns exp(−[angle]×) to the second order: the coordinates of a fixed vector in a frame that
/// turned by `angle`.
pub(super) fn frame_turn(angle: Vec3) -> Mat3 {
    let half = angle * angle * 0.5;
    let xy = angle.x * angle.y * 0.5;
    let xz = angle.x * angle.z * 0.5;
    let yz = angle.y * angle.z * 0.5;
    Mat3::from_cols(
        Vec3::new(1.0 - half.y - half.z, xy - angle.z, xz + angle.y),
        Vec3::new(xy + angle.z, 1.0 - half.x - half.z, yz - angle.x),
        Vec3::new(xz - angle.y, yz + angle.x, 1.0 - half.x - half.y),
    )
}

impl Transition {
    /// Linearizes the model about a motion.
    pub fn new(motion: &Motion, form: Linearization) -> Self {
        let seconds = motion.seconds;
        let turn = motion.turn_rad;
        let mut velocity_turn;
        let attitude_turn;
        let mean_velocity;
        match form {
            Linearization::WholeAngle => {
                attitude_turn = frame_turn(turn);
                velocity_turn = attitude_turn;
                mean_velocity = motion.velocity_m_s + motion.impulse_m_s * 0.5;
            }
            Linearization::HalfAngle => {
                attitude_turn = frame_turn(turn * 0.5);
                velocity_turn = Mat3::from_cols(
                    Vec3::new(1.0, -turn.z, turn.y),
                    Vec3::new(turn.z, 1.0, -turn.x),
                    Vec3::new(-turn.y, turn.x, 1.0),
                );
                mean_velocity = motion.velocity_m_s;
            }
        }
        velocity_turn.x_axis.x -= motion.drag_per_s.x * seconds;
        velocity_turn.y_axis.y -= motion.drag_per_s.y * seconds;
        velocity_turn.z_axis.z -= motion.drag_per_s.z * seconds;
        let rotation = &motion.rotation;
        let up = Vec3::new(rotation.x_axis.z, rotation.y_axis.z, rotation.z_axis.z);
        Transition {
            position_by_velocity: *rotation * seconds,
            mean_velocity,
            velocity_turn,
            gravity: up * (GRAVITY_M_S2 * seconds),
            travel: motion.velocity_m_s * seconds,
            attitude_turn,
            form,
            seconds,
        }
    }

    /// Replaces an error of the state by the error after the prediction.
    pub fn apply(&self, error: &mut [f32; STATES]) {
        let [p0, p1, p2, v0, v1, v2, d0, d1, d2, b0, b1, b2, z] = *error;
        let position = Vec3::new(p0, p1, p2);
        let velocity = Vec3::new(v0, v1, v2);
        let attitude = Vec3::new(d0, d1, d2);
        let gyro_bias = Vec3::new(b0, b1, b2);
        let mut moved = velocity + attitude.cross(self.mean_velocity);
        moved.z -= 0.5 * self.seconds * z;
        let position = position + self.position_by_velocity * moved;
        let fallen = attitude.cross(self.gravity);
        let mut velocity = match self.form {
            Linearization::WholeAngle => self.velocity_turn * (velocity + fallen),
            Linearization::HalfAngle => self.velocity_turn * velocity + fallen,
        } + gyro_bias.cross(self.travel);
        velocity.z -= self.seconds * z;
        let attitude = self.attitude_turn * attitude - gyro_bias * self.seconds;
        *error = [
            position.x, position.y, position.z, velocity.x, velocity.y, velocity.z, attitude.x,
            attitude.y, attitude.z, b0, b1, b2, z,
        ];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DQuat, DVec3};
    use proptest::prelude::*;

    /// The state in f64: position, velocity in the body frame, attitude, both biases.
    #[derive(Clone, Copy)]
    struct Exact {
        position: DVec3,
        velocity: DVec3,
        attitude: DQuat,
        gyro_bias: DVec3,
        accel_bias: f64,
    }

    /// Rate and specific force that sensors measure, and the drag.
    #[derive(Clone, Copy)]
    struct Inputs {
        rate: DVec3,
        accel: DVec3,
        drag: DVec3,
    }

    impl Exact {
        fn plus(&self, error: &[f64; STATES]) -> Exact {
            let at = |i: usize| DVec3::new(error[i], error[i + 1], error[i + 2]);
            Exact {
                position: self.position + at(0),
                velocity: self.velocity + at(3),
                attitude: self.attitude * DQuat::from_scaled_axis(at(6)),
                gyro_bias: self.gyro_bias + at(9),
                accel_bias: self.accel_bias + error[12],
            }
        }

        fn minus(&self, other: &Exact) -> [f64; STATES] {
            let turn = (other.attitude.conjugate() * self.attitude).to_scaled_axis();
            let parts = [
                self.position - other.position,
                self.velocity - other.velocity,
                turn,
                self.gyro_bias - other.gyro_bias,
            ];
            core::array::from_fn(|i| {
                if i == 12 { self.accel_bias - other.accel_bias } else { parts[i / 3][i % 3] }
            })
        }

        /// The differential equation of the model, integrated with small steps of the midpoint rule.
        fn after(&self, inputs: &Inputs, seconds: f64) -> Exact {
            let steps = 200;
            let dt = seconds / f64::from(steps);
            let mut s = *self;
            for _ in 0..steps {
                let rate = inputs.rate - s.gyro_bias;
                let accel = inputs.accel - DVec3::Z * s.accel_bias;
                let slope = |velocity: DVec3, attitude: DQuat| {
                    let gravity = attitude.conjugate() * DVec3::Z * f64::from(GRAVITY_M_S2);
                    accel - rate.cross(velocity) - gravity - inputs.drag * velocity
                };
                let half = s.attitude * DQuat::from_scaled_axis(rate * (0.5 * dt));
                let middle = s.velocity + slope(s.velocity, s.attitude) * (0.5 * dt);
                s.position += half * middle * dt;
                s.velocity += slope(middle, half) * dt;
                s.attitude *= DQuat::from_scaled_axis(rate * dt);
            }
            s
        }
    }

    fn vector(range: f32) -> impl Strategy<Value = Vec3> {
        prop::array::uniform3(-range..range).prop_map(Vec3::from)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        /// Tolerances are the terms of the second order in time that the blocks omit: with rates of
        /// 4 rad/s, 5 m/s and 15 m/s² over 10 ms, such as (ωT)³/6 in rotations and ω·v·T²/2 in positions.
        #[test]
        fn jacobian_equals_numerical_differentiation(
            rate in vector(2.3), velocity in vector(3.0), accel_z in 0.0f32..15.0,
            axis in vector(1.8), drag in 0.0f32..0.6,
        ) {
            let seconds = 0.01f32;
            let attitude = glam::Quat::from_scaled_axis(axis);
            let accel = Vec3::new(0.0, 0.0, accel_z);
            let drag = Vec3::new(drag, drag, 0.0);
            let transition = Transition::new(&Motion {
                rotation: Mat3::from_quat(attitude),
                velocity_m_s: velocity,
                turn_rad: rate * seconds,
                impulse_m_s: accel * seconds,
                drag_per_s: drag,
                seconds,
            }, Linearization::WholeAngle);
            let start = Exact {
                position: DVec3::ZERO,
                velocity: velocity.as_dvec3(),
                attitude: attitude.as_dquat(),
                gyro_bias: DVec3::ZERO,
                accel_bias: 0.0,
            };
            let inputs =
                Inputs { rate: rate.as_dvec3(), accel: accel.as_dvec3(), drag: drag.as_dvec3() };
            for j in 0..STATES {
                let step = 1e-5;
                let mut error = [0.0; STATES];
                error[j] = step;
                let above = start.plus(&error).after(&inputs, f64::from(seconds));
                error[j] = -step;
                let below = start.plus(&error).after(&inputs, f64::from(seconds));
                let numeric = above.minus(&below).map(|difference| difference / (2.0 * step));
                let mut column = [0.0; STATES];
                column[j] = 1.0;
                transition.apply(&mut column);
                for i in 0..STATES {
                    let tolerance = match (i / 3, j / 3) {
                        (0, 1) => 3e-4,
                        (0, 2) => 2e-3,
                        (0, 3) => 1e-3,
                        (0, 4) => 2e-6,
                        (1, 2) => 4e-4,
                        (1, 3) => 2e-3,
                        (1, 4) => 3e-4,
                        (1, 1) => 2e-4,
                        (2, 2) => 1e-5,
                        (2, 3) => 3e-4,
                        _ => 1e-6,
                    };
                    let difference = (f64::from(column[i]) - numeric[i]).abs();
                    prop_assert!(
                        difference < tolerance,
                        "row {}, column {}: {} instead of {}", i, j, column[i], numeric[i]
                    );
                }
            }
        }
    }

    /// The matrix of the filter with nine states, written out as in the literature: with half
    /// angles h = ω·T/2, the diagonal of the attitude is 1 − (h_j² + h_k²)/2.
    #[test]
    fn half_angle_form_equals_the_matrix_with_nine_states() {
        let seconds = 0.01;
        let attitude = glam::Quat::from_euler(glam::EulerRot::ZYX, 0.7, -0.2, 0.3);
        let r = Mat3::from_quat(attitude);
        let velocity = Vec3::new(0.8, -0.5, 0.2);
        let rate = Vec3::new(2.0, -3.0, 1.5);
        let drag = Vec3::new(0.4, 0.3, 0.0);
        let transition = Transition::new(
            &Motion {
                rotation: r,
                velocity_m_s: velocity,
                turn_rad: rate * seconds,
                impulse_m_s: Vec3::Z * 0.1,
                drag_per_s: drag,
                seconds,
            },
            Linearization::HalfAngle,
        );
        let column = |j: usize| {
            let mut unit = [0.0; STATES];
            unit[j] = 1.0;
            transition.apply(&mut unit);
            unit
        };
        let close = |a: f32, b: f32| assert!((a - b).abs() < 1e-7, "{a} instead of {b}");
        let (w, h) = (rate * seconds, rate * seconds * 0.5);
        // Columns of the velocity.
        for j in 0..3 {
            for i in 0..3 {
                close(column(3 + j)[i], r.col(j)[i] * seconds);
            }
            close(column(3 + j)[3 + j], 1.0 - drag[j] * seconds);
        }
        close(column(4)[3], w.z);
        close(column(5)[3], -w.y);
        close(column(3)[4], -w.z);
        close(column(5)[4], w.x);
        close(column(3)[5], w.y);
        close(column(4)[5], -w.x);
        // Columns of the attitude.
        for i in 0..3 {
            let p_d0 = (velocity.y * r.z_axis[i] - velocity.z * r.y_axis[i]) * seconds;
            let p_d1 = (velocity.z * r.x_axis[i] - velocity.x * r.z_axis[i]) * seconds;
            let p_d2 = (velocity.x * r.y_axis[i] - velocity.y * r.x_axis[i]) * seconds;
            close(column(6)[i], p_d0);
            close(column(7)[i], p_d1);
            close(column(8)[i], p_d2);
        }
        let up = Vec3::new(r.x_axis.z, r.y_axis.z, r.z_axis.z) * (GRAVITY_M_S2 * seconds);
        close(column(6)[4], -up.z);
        close(column(6)[5], up.y);
        close(column(7)[3], up.z);
        close(column(7)[5], -up.x);
        close(column(8)[3], -up.y);
        close(column(8)[4], up.x);
        close(column(6)[6], 1.0 - (h.y * h.y + h.z * h.z) / 2.0);
        close(column(7)[7], 1.0 - (h.x * h.x + h.z * h.z) / 2.0);
        close(column(8)[8], 1.0 - (h.x * h.x + h.y * h.y) / 2.0);
        close(column(7)[6], h.z + h.x * h.y / 2.0);
        close(column(8)[6], -h.y + h.x * h.z / 2.0);
        close(column(6)[7], -h.z + h.x * h.y / 2.0);
        close(column(8)[7], h.x + h.y * h.z / 2.0);
        close(column(6)[8], h.y + h.x * h.z / 2.0);
        close(column(7)[8], -h.x + h.y * h.z / 2.0);
    }
}
