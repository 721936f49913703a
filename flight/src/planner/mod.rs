//! The planner: from commands to references.
//!
//! A [`Planner`] receives commands such as "take off" or "go there" and returns the [`Reference`]
//! of each moment. It knows the time, the fence and the limits, but not the state of the robot: a
//! new plan starts from the reference of that moment, so position, velocity and acceleration of the
//! reference never jump.
//!
//! # Plans
//! * A **curve** of degree 7 leads to a point at rest: take-off, landing and "go to".
//! * A **trajectory** is a sequence of polynomial pieces from the caller.
//! * A **velocity filter** follows a commanded velocity, and stops.
//!
//! Every plan ends in hover; only [`Planner::touched_down`] and [`Planner::go_idle`] end the
//! flight.
//!
//! # Durations
//! A curve takes the duration of the command, or the shortest one that keeps the [`FlightLimits`],
//! whichever is longer. From rest the shortest duration is exact (see [`crate::polynomial`]); in
//! motion it is found by a search in steps of 25 %. If no duration works, for instance because the
//! robot flies fast towards a wall, the reference brakes first. [`PlanReport`] has the duration and
//! says so.
//!
//! # Interruption
//! Stopping short of the goal takes room. A command that has to brake waits while braking would
//! leave the fence or exceed a limit: the plan in force continues, which does neither, and which
//! ends at rest.
//!
//! # Fence
//! No reference leaves the fence, except downwards: take-off starts on the ground and landing ends
//! there, even if that is below the fence. A goal outside is moved to the closest point of the
//! fence.

mod command;
mod curve;
mod error;
mod fence;
mod limits;
mod progress;
mod trajectory;
mod velocity;

#[cfg(test)]
mod tests;

pub use command::{Destination, PlanReport};
pub use error::{PieceFault, PlanError};
pub use fence::PositionFence;
pub use limits::FlightLimits;
pub use trajectory::TrajectoryPiece;
pub use velocity::{VelocityCommand, VelocityFrame};

pub(crate) use velocity::wrapped;

use crate::Reference;
use curve::{Curve, FlightGoal, duration_from_rest_s};
use glam::Vec3;
use trajectory::PieceStore;
use velocity::VelocityFilter;

/// Longest duration of a command in seconds. A search may stretch it up to the longest polynomial.
const DURATION_S_MAX: f32 = 1800.0;

/// Least acceleration in m/s² of a robot without thrust to spare, which has to stop nevertheless.
const ACCELERATION_M_S2_MIN: f32 = 0.5;

/// A velocity to follow, and the goal afterwards.
#[derive(Clone, Copy, Debug)]
struct Pursuit {
    command: VelocityCommand,
    goal: Option<FlightGoal>,
}

/// The plan in force.
#[derive(Clone, Copy, Debug)]
enum Motion {
    Idle,
    Curve { curve: Curve, start_s: f64 },
    Trajectory { start_s: f64 },
    Pursuit { filter: VelocityFilter, pursuit: Pursuit, retry_s: f64 },
}

/// A planner that can store a trajectory of up to `PIECES` pieces.
///
/// Times are seconds of any clock that does not run backwards, in `f64` as an `f32` resolves only
/// 4 ms after ten hours. A time before the last one counts as the last one.
#[derive(Clone, Copy, Debug)]
pub struct Planner<const PIECES: usize> {
    /// The limits of a robot with all its thrust, and those at present.
    full_limits: FlightLimits,
    limits: FlightLimits,
    /// The fence, and the part of it that is far enough above the ground.
    whole_fence: PositionFence,
    fence: PositionFence,
    motion: Motion,
    /// The command that waits until braking is safe.
    waiting: Option<Pursuit>,
    is_landing: bool,
    /// A plan that waits for a curve does not search for it by itself.
    defers_retries: bool,
    pieces: PieceStore<PIECES>,
    time_s: f64,
}

impl<const PIECES: usize> Planner<PIECES> {
    /// Returns an idle planner.
    ///
    /// # Errors
    /// Returns [`PlanError::Limits`] if a limit is not finite or not positive.
    pub fn new(limits: FlightLimits, fence: PositionFence) -> Result<Self, PlanError> {
        if !limits.are_valid() {
            return Err(PlanError::Limits);
        }
        Ok(Planner {
            full_limits: limits,
            limits,
            whole_fence: fence,
            fence,
            motion: Motion::Idle,
            waiting: None,
            is_landing: false,
            defers_retries: false,
            pieces: PieceStore::new(),
            time_s: f64::NEG_INFINITY,
        })
    }

    /// Changes the limits and the fence of plans from now on. A plan in force stays as it is.
    ///
    /// # Errors
    /// Returns [`PlanError::Limits`] if a limit is not finite or not positive.
    pub fn restrict(
        &mut self,
        limits: FlightLimits,
        fence: PositionFence,
    ) -> Result<(), PlanError> {
        if !limits.are_valid() {
            return Err(PlanError::Limits);
        }
        (self.full_limits, self.limits) = (limits, limits);
        (self.whole_fence, self.fence) = (fence, fence);
        Ok(())
    }

    /// Limits the acceleration of plans from now on to that for which the robot has thrust, in m/s², at
    /// least 0.5. A curve in force stays as it is.
    pub fn limit_acceleration(&mut self, most_m_s2: f32) {
        self.limits = self.full_limits.with_acceleration(most_m_s2.max(ACCELERATION_M_S2_MIN));
    }

    /// Raises the floor of the fence to a height in m, for plans from now on. A curve in force stays as it
    /// is.
    pub fn raise_floor(&mut self, height_m: f32) {
        let (least_m, most_m) = (self.whole_fence.least_m(), self.whole_fence.most_m());
        let floor_m = least_m.z.max(height_m).min(most_m.z);
        self.fence =
            PositionFence::new(least_m.with_z(floor_m), most_m).unwrap_or(self.whole_fence);
    }

    /// Sets if a robot that brakes before a goal searches for the curve only by [`Self::retry_now`]:
    /// the search takes longer than a reference.
    pub(crate) fn defer_retries(&mut self, defers: bool) {
        self.defers_retries = defers;
    }

    /// Returns the fence of plans at present.
    pub fn fence(&self) -> &PositionFence {
        &self.fence
    }

    /// Returns the limits of plans at present.
    pub fn limits(&self) -> &FlightLimits {
        &self.limits
    }

    /// Returns the reference at this time, or `None` while idle: the motors are then off.
    pub fn reference(&mut self, now_s: f64) -> Option<Reference> {
        self.advance(now_s);
        self.current()
    }

    /// Returns true if there is no reference, so that the motors are off.
    pub fn is_idle(&self) -> bool {
        matches!(self.motion, Motion::Idle)
    }

    /// Returns true from a command to land until touch-down or another command.
    pub fn is_landing(&self) -> bool {
        self.is_landing
    }

    /// Returns true if the last command is done: the planner is idle, or follows a velocity and no
    /// goal waits.
    pub fn is_done(&self) -> bool {
        match &self.motion {
            Motion::Idle => true,
            Motion::Curve { .. } | Motion::Trajectory { .. } => false,
            Motion::Pursuit { pursuit, .. } => pursuit.goal.is_none(),
        }
    }

    /// Takes off from a start, usually the estimated position of a robot on the ground, to a height
    /// in the world frame.
    ///
    /// # Errors
    /// Refuses a robot that flies, a start outside the fence (its floor aside), a height that is
    /// not above the start, a number that is not finite, a duration outside 0 to 1800 s and a goal
    /// that is too far for it.
    pub fn take_off(
        &mut self,
        now_s: f64,
        start_m: Vec3,
        yaw_rad: f32,
        height_m: f32,
        duration_s: Option<f32>,
    ) -> Result<PlanReport, PlanError> {
        if !self.is_idle() {
            return Err(PlanError::Flying);
        }
        require_finite(
            now_s.is_finite() && start_m.is_finite() && yaw_rad.is_finite() && height_m.is_finite(),
        )?;
        require_duration(duration_s)?;
        if !self.fence.extended_to_height(self.fence.least_m().z.min(start_m.z)).contains(start_m) {
            return Err(PlanError::OutsideFence);
        }
        if height_m <= start_m.z {
            return Err(PlanError::Height);
        }
        let start =
            Reference { position_m: start_m, yaw_rad: wrapped(yaw_rad), ..Reference::default() };
        let wanted_m = start_m.with_z(height_m);
        let position_m = self.fence.clamp(wanted_m);
        let goal = FlightGoal { position_m, yaw_rad: start.yaw_rad, duration_s };
        self.require_near(&start, &goal)?;
        let curve =
            Curve::find(&start, &goal, &self.limits, &self.fence).ok_or(PlanError::TooFar)?;
        self.time_s = now_s.max(self.time_s);
        self.motion = Motion::Curve { curve, start_s: self.time_s };
        self.waiting = None;
        self.is_landing = false;
        Ok(PlanReport {
            duration_s: curve.duration_s(),
            is_clamped: position_m != wanted_m,
            brakes_first: false,
        })
    }

    /// Starts in the air with a robot that does not follow a plan, and brakes from its motion.
    ///
    /// # Errors
    /// Refuses a planner with a plan and a number that is not finite.
    pub fn catch(&mut self, now_s: f64, present: &Reference) -> Result<(), PlanError> {
        if !self.is_idle() {
            return Err(PlanError::Flying);
        }
        let Reference { position_m, velocity_m_s, .. } = *present;
        require_finite(now_s.is_finite() && (position_m + velocity_m_s).is_finite())?;
        self.time_s = now_s.max(self.time_s);
        let filter = VelocityFilter::from_reference(present, &self.limits);
        let pursuit = Pursuit { command: VelocityCommand::STOP, goal: None };
        self.motion = Motion::Pursuit { filter, pursuit, retry_s: self.time_s };
        self.waiting = None;
        self.is_landing = false;
        Ok(())
    }

    /// Lands at a height of the ground in the world frame, above the point where the reference
    /// stops. The reference waits there until [`Planner::touched_down`].
    ///
    /// # Errors
    /// Refuses a robot that does not fly or that lands already, a number that is not finite, a
    /// duration outside 0 to 1800 s and ground that is too far for it.
    pub fn land(
        &mut self,
        now_s: f64,
        ground_m: f32,
        duration_s: Option<f32>,
    ) -> Result<PlanReport, PlanError> {
        let start = self.current_at(now_s)?;
        if self.is_landing {
            return Err(PlanError::Landing);
        }
        require_finite(ground_m.is_finite())?;
        require_duration(duration_s)?;
        let stop_m = VelocityFilter::from_reference(&start, &self.limits).stop_m(&self.limits);
        let position_m = self.fence.clamp(stop_m).with_z(ground_m.min(self.fence.most_m().z));
        let goal = FlightGoal { position_m, yaw_rad: start.yaw_rad, duration_s };
        self.require_near(&start, &goal)?;
        let report = self.pursue_goal(&start, goal, position_m.z != ground_m);
        self.is_landing = true;
        Ok(report)
    }

    /// Ends a landing: the motors turn off.
    ///
    /// # Errors
    /// Returns [`PlanError::NotLanding`] if the robot does not land, so that a wrong detection of
    /// the ground stops no robot in flight.
    pub fn touched_down(&mut self) -> Result<(), PlanError> {
        if !self.is_landing {
            return Err(PlanError::NotLanding);
        }
        self.go_idle();
        Ok(())
    }

    /// Drops every plan at once: the motors turn off, even in flight.
    pub fn go_idle(&mut self) {
        self.motion = Motion::Idle;
        self.waiting = None;
        self.is_landing = false;
    }

    /// Flies to a point and stops there. A destination outside the fence is clamped.
    ///
    /// # Errors
    /// Refuses a robot that does not fly, a number that is not finite, a duration outside 0 to
    /// 1800 s and a goal that is too far for it.
    pub fn go_to(
        &mut self,
        now_s: f64,
        destination: Destination,
        duration_s: Option<f32>,
    ) -> Result<PlanReport, PlanError> {
        let start = self.current_at(now_s)?;
        require_duration(duration_s)?;
        let (wanted_m, yaw_rad) = match destination {
            Destination::Absolute { position_m, yaw_rad } => {
                (position_m, yaw_rad.unwrap_or(start.yaw_rad))
            }
            Destination::Relative { displacement_m, turn_rad } => {
                (start.position_m + displacement_m, start.yaw_rad + turn_rad)
            }
        };
        require_finite(wanted_m.is_finite() && yaw_rad.is_finite())?;
        let position_m = self.fence.clamp(wanted_m);
        let goal = FlightGoal { position_m, yaw_rad: wrapped(yaw_rad), duration_s };
        self.require_near(&start, &goal)?;
        let report = self.pursue_goal(&start, goal, position_m != wanted_m);
        self.is_landing = false;
        Ok(report)
    }

    /// Follows a velocity until the next command. The velocity is limited, and brakes in front of
    /// the fence.
    ///
    /// # Errors
    /// Refuses a robot that does not fly and a number that is not finite.
    pub fn follow_velocity(
        &mut self,
        now_s: f64,
        command: VelocityCommand,
    ) -> Result<PlanReport, PlanError> {
        let start = self.current_at(now_s)?;
        require_finite(command.is_finite())?;
        let is_clamped = !self.limits.allow_velocity(command.velocity_m_s)
            || !self.limits.allow_yaw_rate(command.yaw_rate_rad_s);
        self.pursue(&start, Pursuit { command, goal: None });
        self.is_landing = false;
        Ok(PlanReport { duration_s: 0.0, is_clamped, brakes_first: false })
    }

    /// Brakes and hovers where the reference stops.
    ///
    /// # Errors
    /// Returns [`PlanError::NotFlying`] while idle.
    pub fn hover(&mut self, now_s: f64) -> Result<PlanReport, PlanError> {
        let start = self.current_at(now_s)?;
        self.pursue(&start, Pursuit { command: VelocityCommand::STOP, goal: None });
        self.is_landing = false;
        let filter = VelocityFilter::from_reference(&start, &self.limits);
        Ok(PlanReport {
            duration_s: filter.stop_s(&self.limits),
            is_clamped: false,
            brakes_first: false,
        })
    }

    /// Follows the pieces of a trajectory and hovers at its end. If `is_relative`, the trajectory
    /// is moved so that it starts at the position of the reference; the yaw is never changed.
    ///
    /// # Errors
    /// Refuses a robot that does not fly, no pieces, too many pieces, and the first piece that
    /// jumps, exceeds a limit, leaves the fence or, as the last one, does not end at rest.
    pub fn follow_trajectory(
        &mut self,
        now_s: f64,
        pieces: &[TrajectoryPiece],
        is_relative: bool,
    ) -> Result<PlanReport, PlanError> {
        let start = self.current_at(now_s)?;
        let (first, last) = match pieces {
            [] => return Err(PlanError::NoPiece),
            [first, .., last] => (first, last),
            [only] => (only, only),
        };
        if pieces.len() > PIECES {
            return Err(PlanError::TooManyPieces);
        }
        let offset_m = match is_relative {
            true => start.position_m - first.at(0.0).position_m,
            false => Vec3::ZERO,
        };
        let mut before = start;
        for (piece, moved) in pieces.iter().map(|piece| piece.moved_by(offset_m)).enumerate() {
            if let Some(fault) = moved.fault(&before, &self.limits, &self.fence) {
                return Err(PlanError::Piece { piece, fault });
            }
            before = moved.at(moved.duration_s());
        }
        if !trajectory::is_at_rest(&last.at(last.duration_s())) {
            let (piece, fault) = (pieces.len() - 1, PieceFault::EndsInMotion);
            return Err(PlanError::Piece { piece, fault });
        }
        self.pieces.fill(pieces, offset_m);
        self.motion = Motion::Trajectory { start_s: self.time_s };
        self.waiting = None;
        self.is_landing = false;
        Ok(PlanReport {
            duration_s: self.pieces.duration_s(),
            is_clamped: false,
            brakes_first: false,
        })
    }

    /// Refuses a goal that is too far.
    fn require_near(&self, start: &Reference, goal: &FlightGoal) -> Result<(), PlanError> {
        let is_near = duration_from_rest_s(start, goal, &self.limits) <= DURATION_S_MAX;
        if is_near { Ok(()) } else { Err(PlanError::TooFar) }
    }

    /// Returns the reference of the last time.
    fn current(&self) -> Option<Reference> {
        match &self.motion {
            Motion::Idle => None,
            Motion::Curve { curve, start_s } => Some(curve.at((self.time_s - start_s) as f32)),
            Motion::Trajectory { start_s } => {
                let mut reference = self.pieces.at((self.time_s - start_s) as f32);
                reference.position_m = self.fence.clamp(reference.position_m);
                Some(reference)
            }
            Motion::Pursuit { filter, .. } => Some(filter.reference(&self.limits)),
        }
    }

    /// Returns the reference from which a new plan starts.
    fn current_at(&mut self, now_s: f64) -> Result<Reference, PlanError> {
        require_finite(now_s.is_finite())?;
        self.reference(now_s).ok_or(PlanError::NotFlying)
    }
}

fn require_finite(is_finite: bool) -> Result<(), PlanError> {
    if is_finite { Ok(()) } else { Err(PlanError::NotFinite) }
}

fn require_duration(duration_s: Option<f32>) -> Result<(), PlanError> {
    match duration_s {
        Some(duration_s) if duration_s > 0.0 && duration_s <= DURATION_S_MAX => Ok(()),
        Some(_) => Err(PlanError::Duration),
        None => Ok(()),
    }
}
