//! Trajectories of polynomial pieces.

use super::curve::reference_at;
use super::velocity::wrapped;
use super::{FlightLimits, PieceFault, PositionFence};
use crate::Reference;
use crate::polynomial::Polynomial;
use glam::Vec3;

/// Largest step of the position at a joint, in m.
const POSITION_TOLERANCE_M: f32 = 2e-3;
/// Largest step of the velocity at a joint, in m/s.
const VELOCITY_TOLERANCE_M_S: f32 = 1e-2;
/// Largest step of the acceleration at a joint, in m/s².
const ACCELERATION_TOLERANCE_M_S2: f32 = 0.1;
/// Largest step of the yaw (rad) and its rate (rad/s) at a joint.
const YAW_TOLERANCE: f32 = 1e-2;

/// A piece of a trajectory: a polynomial of degree 7 for each axis and for the yaw.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrajectoryPiece {
    position: Polynomial<Vec3>,
    yaw: Polynomial<f32>,
}

impl TrajectoryPiece {
    /// Returns a piece from the coefficients of powers of the time in seconds: m/sᵏ and rad/sᵏ.
    ///
    /// Returns `None` if a number is not finite or the duration is not in the range of 1 ms to an
    /// hour.
    pub fn new(duration_s: f32, position: [Vec3; 8], yaw: [f32; 8]) -> Option<Self> {
        Some(TrajectoryPiece {
            position: Polynomial::from_powers_of_time(position, duration_s)?,
            yaw: Polynomial::from_powers_of_time(yaw, duration_s)?,
        })
    }

    /// Returns the duration in seconds.
    pub fn duration_s(&self) -> f32 {
        self.position.duration_s()
    }

    /// Returns the reference at a time after the start of the piece.
    pub fn at(&self, time_s: f32) -> Reference {
        reference_at(&self.position, &self.yaw, time_s)
    }

    /// Returns this piece moved by `offset_m`.
    pub(super) fn moved_by(self, offset_m: Vec3) -> Self {
        TrajectoryPiece { position: self.position.moved_by(offset_m), yaw: self.yaw }
    }

    /// Returns the first reason why the piece cannot follow `before`, if there is one.
    pub(super) fn fault(
        &self,
        before: &Reference,
        limits: &FlightLimits,
        fence: &PositionFence,
    ) -> Option<PieceFault> {
        let start = self.at(0.0);
        let yaw_step = wrapped(start.yaw_rad - before.yaw_rad);
        let yaw_rate_step = start.yaw_rate_rad_s - before.yaw_rate_rad_s;
        let position = &self.position;
        let checks = [
            (
                start.position_m.distance(before.position_m) <= POSITION_TOLERANCE_M,
                PieceFault::Position,
            ),
            (
                start.velocity_m_s.distance(before.velocity_m_s) <= VELOCITY_TOLERANCE_M_S,
                PieceFault::Velocity,
            ),
            (
                start.acceleration_m_s2.distance(before.acceleration_m_s2)
                    <= ACCELERATION_TOLERANCE_M_S2,
                PieceFault::Acceleration,
            ),
            (
                libm::fabsf(yaw_step).max(libm::fabsf(yaw_rate_step)) <= YAW_TOLERANCE,
                PieceFault::Yaw,
            ),
            (
                position.hull_is_inside(1, |value| limits.allow_velocity(value)),
                PieceFault::SpeedLimit,
            ),
            (
                position.hull_is_inside(2, |value| limits.allow_acceleration(value)),
                PieceFault::AccelerationLimit,
            ),
            (position.hull_is_inside(3, |value| limits.allow_jerk(value)), PieceFault::JerkLimit),
            (
                self.yaw.hull_is_inside(1, |value| limits.allow_yaw_rate(value)),
                PieceFault::YawRateLimit,
            ),
            (position.hull_is_inside(0, |value| fence.nearly_contains(value)), PieceFault::Fence),
        ];
        checks.into_iter().find(|(is_met, _)| !is_met).map(|(_, fault)| fault)
    }
}

/// Returns true if the reference is at rest within the tolerance of a joint.
pub(super) fn is_at_rest(reference: &Reference) -> bool {
    reference.velocity_m_s.length() <= VELOCITY_TOLERANCE_M_S
        && reference.acceleration_m_s2.length() <= ACCELERATION_TOLERANCE_M_S2
        && libm::fabsf(reference.yaw_rate_rad_s) <= YAW_TOLERANCE
}

/// The pieces that a planner stores.
#[derive(Clone, Copy, Debug)]
pub(super) struct PieceStore<const PIECES: usize> {
    pieces: [Option<TrajectoryPiece>; PIECES],
}

impl<const PIECES: usize> PieceStore<PIECES> {
    /// Returns an empty store.
    pub fn new() -> Self {
        PieceStore { pieces: [None; PIECES] }
    }

    /// Stores pieces, moved by `offset_m`. Pieces after the end of the store are lost.
    pub fn fill(&mut self, pieces: &[TrajectoryPiece], offset_m: Vec3) {
        self.pieces = [None; PIECES];
        for (slot, piece) in self.pieces.iter_mut().zip(pieces) {
            *slot = Some(piece.moved_by(offset_m));
        }
    }

    /// Returns the duration of all pieces in seconds.
    pub fn duration_s(&self) -> f32 {
        self.pieces.iter().flatten().map(TrajectoryPiece::duration_s).sum()
    }

    /// Returns the reference at a time after the start of the trajectory, and the last reference
    /// after its end.
    pub fn at(&self, time_s: f32) -> Reference {
        let mut left_s = time_s;
        let mut last = None;
        for piece in self.pieces.iter().flatten() {
            if left_s < piece.duration_s() {
                return piece.at(left_s);
            }
            left_s -= piece.duration_s();
            last = Some(piece);
        }
        last.map(|piece| piece.at(piece.duration_s())).unwrap_or_default()
    }
}
