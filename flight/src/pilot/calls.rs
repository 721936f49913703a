//! The functions that a script calls: what begins a task, and when the script goes on.

use glam::{Vec2, Vec3};

use super::function::FlightRequest;
use super::{
    ARRIVAL_MS, Aircraft, Goal, Permission, PermissionEnd, Pilot, PilotAnswer, PilotMoment,
    PilotRefusal, READY_MS, SPIN_MS, TOUCHDOWN_MS, Task, is_in_air,
};
use crate::planner::Destination;
use crate::supervisor::SupervisorStage;

/// Time in seconds that an approach by velocities takes in addition to the way at full speed, until
/// the rest of the way is 5 cm: the last half meter takes ln 10 s.
const APPROACH_S: f32 = 1.5;
impl Pilot {
    /// Begins a function.
    pub(super) fn begin<A: Aircraft + ?Sized>(
        &mut self,
        request: &FlightRequest,
        aircraft: &mut A,
        moment: PilotMoment,
    ) -> Result<PilotAnswer, PilotRefusal> {
        match *request {
            FlightRequest::TakeOff { height_m, pace_m_s } => {
                self.take_off(height_m, pace_m_s, aircraft, moment)
            }
            FlightRequest::Land { pace_m_s } => {
                if !is_in_air(aircraft.status().stage) {
                    return Ok(PilotAnswer::Done(true));
                }
                self.land(pace_m_s, aircraft, moment.now_ms);
                Ok(PilotAnswer::Waiting)
            }
            FlightRequest::Hover { height_m } => {
                self.cruise(Vec2::ZERO, 0.0, height_m, aircraft)?;
                Ok(PilotAnswer::Done(true))
            }
            FlightRequest::Spin { height_m, rate_rad_s } => {
                self.cruise(Vec2::ZERO, rate_rad_s, height_m, aircraft)?;
                self.wait_until_ms = moment.now_ms + SPIN_MS;
                Ok(PilotAnswer::Waiting)
            }
            FlightRequest::Cruise { forward_m_s, left_m_s, turn_rad_s } => {
                let ahead_m_s = Vec2::new(forward_m_s, left_m_s);
                self.cruise(ahead_m_s, turn_rad_s, self.height_m, aircraft)?;
                Ok(PilotAnswer::Done(true))
            }
            FlightRequest::GoTo { position_m } => self.go_to(position_m, aircraft, moment.now_ms),
            FlightRequest::Approach { x_m, y_m, height_m } => {
                self.require_flight(aircraft)?;
                self.height_m = height_m.unwrap_or(self.height_m);
                let position_m = self.centered(Vec3::new(x_m, y_m, self.height_m));
                let goal = Goal { position_m, yaw_rad: None };
                self.task = Task::Approach { goal };
                Ok(PilotAnswer::Done(self.is_at(&goal, aircraft)))
            }
        }
    }

    /// Continues a function for which the script waits.
    pub(super) fn poll<A: Aircraft + ?Sized>(
        &mut self,
        request: &FlightRequest,
        aircraft: &mut A,
        moment: PilotMoment,
    ) -> Result<PilotAnswer, PilotRefusal> {
        let is_over = moment.now_ms >= self.wait_until_ms;
        match *request {
            FlightRequest::Land { .. } => {
                let is_down = self.task == Task::Rest && !is_in_air(aircraft.status().stage);
                Ok(if is_down || is_over {
                    PilotAnswer::Done(is_down)
                } else {
                    PilotAnswer::Waiting
                })
            }
            FlightRequest::Spin { height_m, .. } if is_over => {
                // A robot that lands meanwhile refuses.
                self.cruise(Vec2::ZERO, 0.0, height_m, aircraft)?;
                Ok(PilotAnswer::Done(true))
            }
            FlightRequest::Spin { .. } => Ok(PilotAnswer::Waiting),
            _ => self.poll_arrival(aircraft, moment.now_ms),
        }
    }

    /// Returns an answer to a script that waits until the robot is at its goal.
    fn poll_arrival<A: Aircraft + ?Sized>(
        &mut self,
        aircraft: &A,
        now_ms: u64,
    ) -> Result<PilotAnswer, PilotRefusal> {
        let is_there = match self.task {
            Task::Start { .. } => return Ok(PilotAnswer::Waiting),
            Task::Plan { goal, end_ms } => now_ms >= end_ms && self.is_at(&goal, aircraft),
            Task::Approach { goal } => self.is_at(&goal, aircraft),
            Task::Rest | Task::Cruise { .. } | Task::Land => {
                return match self.failure.take() {
                    Some(failure) => Err(failure),
                    None => Ok(PilotAnswer::Done(false)),
                };
            }
        };
        let is_over = now_ms >= self.wait_until_ms;
        Ok(if is_there || is_over { PilotAnswer::Done(is_there) } else { PilotAnswer::Waiting })
    }

    fn take_off<A: Aircraft + ?Sized>(
        &mut self,
        height_m: f32,
        pace_m_s: Option<f32>,
        aircraft: &mut A,
        moment: PilotMoment,
    ) -> Result<PilotAnswer, PilotRefusal> {
        if height_m <= 0.0 {
            return Ok(PilotAnswer::OutOfRange);
        }
        self.require_permission(moment.now_ms)?;
        let PilotMoment { now_ms, battery_mv } = moment;
        let needed_mv = self.settings.battery_low_mv;
        if battery_mv < needed_mv {
            self.permission.end(PermissionEnd::Battery);
            return Err(PilotRefusal::BatteryLow { battery_mv, needed_mv });
        }
        let status = aircraft.status();
        self.failure = None;
        self.height_m = status.ground_m - self.settings.standing_m + height_m;
        if is_in_air(status.stage) {
            self.require_flight(aircraft)?;
            let above_m = status.state.position_m.with_z(status.ground_m + height_m);
            self.fly_to(Goal { position_m: above_m, yaw_rad: None }, aircraft, now_ms)?;
        } else {
            let until_ms = now_ms + READY_MS;
            self.task = Task::Start { height_m, pace_m_s, until_ms };
        }
        Ok(PilotAnswer::Waiting)
    }

    pub(super) fn land<A: Aircraft + ?Sized>(
        &mut self,
        pace_m_s: Option<f32>,
        aircraft: &mut A,
        now_ms: u64,
    ) {
        let status = aircraft.status();
        let drop_m = (status.state.position_m.z - status.ground_m).max(0.0);
        let duration_s = pace_m_s.map(|pace_m_s| drop_m / pace_m_s).filter(|s| *s > 0.0);
        let plan_s = match aircraft.land(duration_s) {
            Ok(report) => report.duration_s,
            // A robot that the supervisor lands, or that cannot land in this time, lands by itself.
            Err(_) => drop_m / self.settings.limits.climb_m_s,
        };
        // The supervisor needs no pilot for a landing that it began.
        let is_own = status.stage != SupervisorStage::Landing;
        self.task = if is_own { Task::Land } else { Task::Rest };
        self.wait_until_ms = now_ms + milliseconds(plan_s) + TOUCHDOWN_MS;
    }

    fn go_to<A: Aircraft + ?Sized>(
        &mut self,
        position_m: Vec3,
        aircraft: &mut A,
        now_ms: u64,
    ) -> Result<PilotAnswer, PilotRefusal> {
        self.require_flight(aircraft)?;
        self.failure = None;
        let goal = Goal { position_m: self.centered(position_m), yaw_rad: Some(0.0) };
        if self.avoidance.is_some() {
            let way_m = aircraft.status().state.position_m.distance(goal.position_m);
            let plan_s = way_m / self.settings.approach_m_s + APPROACH_S;
            self.task = Task::Approach { goal };
            self.wait_until_ms = now_ms + milliseconds(plan_s) + ARRIVAL_MS;
        } else {
            self.fly_to(goal, aircraft, now_ms)?;
        }
        self.height_m = position_m.z;
        Ok(PilotAnswer::Waiting)
    }

    /// Plans a flight to a goal, for which the script waits.
    fn fly_to<A: Aircraft + ?Sized>(
        &mut self,
        goal: Goal,
        aircraft: &mut A,
        now_ms: u64,
    ) -> Result<(), PilotRefusal> {
        let Goal { position_m, yaw_rad } = goal;
        let report = aircraft.go_to(Destination::Absolute { position_m, yaw_rad })?;
        self.follow_plan(goal, now_ms, report.duration_s);
        Ok(())
    }

    /// Follows a plan, for which the script waits.
    pub(super) fn follow_plan(&mut self, goal: Goal, now_ms: u64, duration_s: f32) {
        let end_ms = now_ms + milliseconds(duration_s);
        self.task = Task::Plan { goal, end_ms };
        self.wait_until_ms = end_ms + ARRIVAL_MS;
    }

    fn cruise<A: Aircraft + ?Sized>(
        &mut self,
        ahead_m_s: Vec2,
        turn_rad_s: f32,
        height_m: f32,
        aircraft: &A,
    ) -> Result<(), PilotRefusal> {
        self.require_flight(aircraft)?;
        self.height_m = height_m;
        let Vec2 { x: forward_m_s, y: left_m_s } = ahead_m_s;
        self.task = Task::Cruise { forward_m_s, left_m_s, turn_rad_s, height_m };
        Ok(())
    }

    pub(super) fn require_permission(&mut self, now_ms: u64) -> Result<(), PilotRefusal> {
        self.permission.expire(now_ms);
        match self.permission {
            Permission::Given { .. } => Ok(()),
            Permission::Absent => Err(PilotRefusal::NotArmed),
            Permission::Ended(reason) => Err(PilotRefusal::Ended(reason)),
        }
    }

    /// Refuses a robot that does not fly by commands. One that stays level for want of a position
    /// flies on once it has one.
    fn require_flight<A: Aircraft + ?Sized>(&self, aircraft: &A) -> Result<(), PilotRefusal> {
        let status = aircraft.status();
        let is_flying = matches!(status.stage, SupervisorStage::Flying | SupervisorStage::LevelOut);
        if is_flying && !status.has_landed && !matches!(self.task, Task::Rest | Task::Land) {
            return Ok(());
        }
        match self.permission {
            Permission::Ended(reason) => Err(PilotRefusal::Ended(reason)),
            _ => Err(PilotRefusal::NotFlying),
        }
    }

    /// Returns the position of the center of mass for a position as in `pos`.
    fn centered(&self, position_m: Vec3) -> Vec3 {
        position_m + Vec3::Z * self.settings.standing_m
    }

    fn is_at<A: Aircraft + ?Sized>(&self, goal: &Goal, aircraft: &A) -> bool {
        let here_m = aircraft.status().state.position_m;
        here_m.distance(goal.position_m) < self.settings.arrival_m
    }
}

fn milliseconds(seconds: f32) -> u64 {
    // A conversion from f32 saturates, and a duration is at most half an hour.
    (seconds * 1000.0) as u64
}
