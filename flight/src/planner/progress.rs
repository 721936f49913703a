//! Progress of a planner from one plan to the next.

use super::curve::{Curve, FlightGoal, duration_from_rest_s};
use super::velocity::VelocityFilter;
use super::{Motion, PlanReport, Planner, Pursuit, VelocityCommand};
use crate::Reference;

/// Time in seconds between attempts to leave a braking maneuver for a curve.
const RETRY_S: f64 = 0.1;

impl<const PIECES: usize> Planner<PIECES> {
    /// Starts a curve to a goal, or brakes first if there is no curve yet.
    pub(super) fn pursue_goal(
        &mut self,
        start: &Reference,
        goal: FlightGoal,
        is_clamped: bool,
    ) -> PlanReport {
        if let Some(curve) = self.find_curve(start, &goal) {
            self.motion = Motion::Curve { curve, start_s: self.time_s };
            self.waiting = None;
            return PlanReport { duration_s: curve.duration_s(), is_clamped, brakes_first: false };
        }
        self.pursue(start, Pursuit { command: VelocityCommand::STOP, goal: Some(goal) });
        let filter = VelocityFilter::from_reference(start, &self.limits);
        let stop = Reference { position_m: filter.stop_m(&self.limits), ..*start };
        let duration_s =
            filter.stop_s(&self.limits) + duration_from_rest_s(&stop, &goal, &self.limits);
        PlanReport { duration_s, is_clamped, brakes_first: true }
    }

    /// Returns a curve to a goal; only a goal on the ground may be below the fence.
    fn find_curve(&self, start: &Reference, goal: &FlightGoal) -> Option<Curve> {
        let fence = self.fence.extended_to_height(goal.position_m.z);
        Curve::find(start, goal, &self.limits, &fence)
    }

    /// Follows a velocity as soon as braking from there is safe.
    pub(super) fn pursue(&mut self, start: &Reference, pursuit: Pursuit) {
        let retry_s = self.time_s + RETRY_S;
        if let Motion::Pursuit { filter, .. } = self.motion {
            self.motion = Motion::Pursuit { filter, pursuit, retry_s };
            return;
        }
        let filter = VelocityFilter::from_reference(start, &self.limits);
        if filter.can_brake(&self.limits, &self.fence) {
            self.motion = Motion::Pursuit { filter, pursuit, retry_s };
            self.waiting = None;
        } else {
            self.waiting = Some(pursuit);
        }
    }

    /// Moves the time forward.
    pub(super) fn advance(&mut self, now_s: f64) {
        if !now_s.is_finite() || now_s <= self.time_s {
            return;
        }
        self.leave_finished_plan(now_s);
        let moment_s = core::mem::replace(&mut self.time_s, now_s);
        if let (Some(pursuit), Some(reference)) = (self.waiting, self.current()) {
            self.pursue(&reference, pursuit);
        } else if let Motion::Pursuit { filter, pursuit, .. } = &mut self.motion {
            let time_s = (now_s - moment_s) as f32;
            filter.advance(time_s, &pursuit.command, &self.limits, &self.fence);
            if !self.defers_retries && self.is_retry_due() {
                self.retry_now();
            }
        }
    }

    /// Hovers, or follows the command that waits, from the end of a plan that ends before `now_s`.
    fn leave_finished_plan(&mut self, now_s: f64) {
        let end_s = match &self.motion {
            Motion::Curve { curve, start_s } => start_s + f64::from(curve.duration_s()),
            Motion::Trajectory { start_s } => start_s + f64::from(self.pieces.duration_s()),
            Motion::Idle | Motion::Pursuit { .. } => return,
        };
        if now_s < end_s {
            return;
        }
        self.time_s = end_s.max(self.time_s);
        let Some(end) = self.current() else { return };
        let rest =
            Reference { position_m: end.position_m, yaw_rad: end.yaw_rad, ..Reference::default() };
        let filter = VelocityFilter::from_reference(&rest, &self.limits);
        let hover = Pursuit { command: VelocityCommand::STOP, goal: None };
        let pursuit = self.waiting.take().unwrap_or(hover);
        self.motion = Motion::Pursuit { filter, pursuit, retry_s: end_s };
    }

    /// Returns true if a robot that brakes before a goal should search for a curve to it.
    pub(crate) fn is_retry_due(&self) -> bool {
        match &self.motion {
            Motion::Pursuit { pursuit, retry_s, .. } => {
                pursuit.goal.is_some() && self.time_s >= *retry_s
            }
            _ => false,
        }
    }

    /// Leaves a braking maneuver once a curve leads to the goal.
    pub(crate) fn retry_now(&mut self) {
        let Motion::Pursuit { filter, pursuit, retry_s } = &mut self.motion else { return };
        let Some(goal) = pursuit.goal else { return };
        *retry_s = self.time_s + RETRY_S;
        let start = filter.reference(&self.limits);
        if let Some(curve) = self.find_curve(&start, &goal) {
            self.motion = Motion::Curve { curve, start_s: self.time_s };
        }
    }
}
