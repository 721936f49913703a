//! The linear map that carries the error of the state over one prediction.

use glam::{Mat3, Vec3};

use super::config::Linearization;
use super::covariance::STATES;
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
/// * velocity: (turn − B·T)·v + d×(g·T·Rᵀe₃) + b×(T·v̂) − e₃·T·z, with b the bias of the gyroscope;
/// * attitude: turn·d − T·b.
#[derive(Clone, Copy, Debug)]
pub(super) struct Transition {
    position_by_velocity: Mat3,
    mean_velocity: Vec3,
    velocity_turn: Mat3,
    gravity: Vec3,
    travel: Vec3,
    attitude_turn: Mat3,
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
        let mut velocity = self.velocity_turn * velocity
            + attitude.cross(self.gravity)
            + gyro_bias.cross(self.travel);
        velocity.z -= self.seconds * z;
        let attitude = self.attitude_turn * attitude - gyro_bias * self.seconds;
        *error = [
            position.x, position.y, position.z, velocity.x, velocity.y, velocity.z, attitude.x,
            attitude.y, attitude.z, b0, b1, b2, z,
        ];
    }
}
