//! The tasks that last until the next call: each tick continues the present one.

use glam::{Vec2, Vec3};

use super::{
    Aircraft, AircraftStatus, EMPTY_MS, Goal, PermissionEnd, Pilot, PilotMoment, PilotRefusal,
    Task, is_in_air,
};
use crate::planner::{VelocityCommand, VelocityFrame, wrapped};
use crate::supervisor::SupervisorStage;

/// Speed per distance from a goal in 1/s: horizontally, vertically and of the yaw.
const APPROACH_1_S: f32 = 1.0;
const CLIMB_1_S: f32 = 2.0;
const FACE_1_S: f32 = 1.0;
/// Change of a velocity in m/s from which a plan is in the way of another robot.
const YIELD_M_S: f32 = 0.02;
/// Vertical speed in m/s of a landing that gave way to another robot.
const SINK_M_S: f32 = 0.3;

impl Pilot {
    /// Reacts to what the supervisor did.
    pub(super) fn watch_stage<A: Aircraft + ?Sized>(&mut self, aircraft: &mut A) {
        let status = aircraft.status();
        let end = match status.stage {
            SupervisorStage::Tumbled | SupervisorStage::Crashed => Some(PermissionEnd::Crash),
            SupervisorStage::Locked | SupervisorStage::Landing => Some(PermissionEnd::Fault),
            _ => None,
        };
        if let Some(end) = end {
            self.permission.end(end);
            if let Task::Start { .. } = self.task {
                self.failure = Some(PilotRefusal::Ended(end));
            }
            self.task = Task::Rest;
        }
        let has_landed = status.stage == SupervisorStage::Landed
            || status.stage == SupervisorStage::Flying && status.has_landed;
        if has_landed {
            aircraft.stop();
        }
        let is_disarmed =
            matches!(status.stage, SupervisorStage::Ready | SupervisorStage::Preflight);
        if (has_landed || is_disarmed) && !matches!(self.task, Task::Start { .. }) {
            self.task = Task::Rest;
        }
    }

    /// Lands a robot whose battery has been empty for [`EMPTY_MS`].
    pub(super) fn watch_battery<A: Aircraft + ?Sized>(
        &mut self,
        aircraft: &mut A,
        moment: PilotMoment,
    ) {
        let PilotMoment { now_ms, battery_mv } = moment;
        if battery_mv >= self.settings.battery_empty_mv {
            self.empty_since_ms = None;
            return;
        }
        if now_ms < *self.empty_since_ms.get_or_insert(now_ms) + EMPTY_MS {
            return;
        }
        self.permission.end(PermissionEnd::Battery);
        if !matches!(self.task, Task::Rest | Task::Start { .. } | Task::Land) {
            self.land(None, aircraft, now_ms);
        }
    }

    /// Continues the task.
    pub(super) fn follow<A: Aircraft + ?Sized>(&mut self, aircraft: &mut A, moment: PilotMoment) {
        let status = aircraft.status();
        match self.task {
            Task::Rest => {
                // A supervisor that resumed a flight which the pilot ended.
                if status.stage == SupervisorStage::Flying && !status.has_landed {
                    self.land(None, aircraft, moment.now_ms);
                }
            }
            Task::Start { height_m, pace_m_s, until_ms } => {
                if let Err(reason) = self.require_permission(moment.now_ms) {
                    self.fail(reason, aircraft);
                    return;
                }
                self.start(height_m, pace_m_s, aircraft, moment.now_ms);
                let has_started = !matches!(self.task, Task::Start { .. });
                if !has_started && moment.now_ms >= until_ms {
                    self.fail(PilotRefusal::NotReady, aircraft);
                }
            }
            Task::Plan { goal, end_ms } => {
                self.follow_or_yield(goal, end_ms, &status, aircraft, moment)
            }
            Task::Approach { goal } => {
                let wanted_m_s = self.approach_velocity(&goal, &status);
                let yaw = yaw_rad(&status);
                let turn_rad_s = goal.yaw_rad.map_or(0.0, |to| FACE_1_S * wrapped(to - yaw));
                self.fly(wanted_m_s, turn_rad_s, &status, aircraft, moment);
            }
            Task::Cruise { forward_m_s, left_m_s, turn_rad_s, height_m } => {
                let climb_m_s = self.climb_m_s(self.settings.standing_m + height_m, &status);
                // The avoidance needs a velocity in the frame of the world.
                let yaw = status.reference.map_or(yaw_rad(&status), |reference| reference.yaw_rad);
                let (sine, cosine) = libm::sincosf(yaw);
                let along_m_s = Vec2::new(cosine, sine).rotate(Vec2::new(forward_m_s, left_m_s));
                if self.avoidance.is_some() {
                    let wanted_m_s = along_m_s.extend(climb_m_s);
                    self.fly(wanted_m_s, turn_rad_s, &status, aircraft, moment);
                } else {
                    aircraft.fly(&VelocityCommand {
                        frame: VelocityFrame::Yaw,
                        velocity_m_s: Vec3::new(forward_m_s, left_m_s, climb_m_s),
                        yaw_rate_rad_s: turn_rad_s,
                    });
                }
            }
            Task::Land => self.sink(&status, aircraft, moment),
        }
    }

    /// Arms the robot and takes off.
    fn start<A: Aircraft + ?Sized>(
        &mut self,
        height_m: f32,
        pace_m_s: Option<f32>,
        aircraft: &mut A,
        now_ms: u64,
    ) {
        let status = aircraft.status();
        match status.stage {
            // A robot that is not ready any more is asked again in the next tick.
            SupervisorStage::Ready => {
                let _ = aircraft.arm();
            }
            SupervisorStage::Armed => {
                let duration_s = pace_m_s.map(|pace_m_s| height_m / pace_m_s);
                match aircraft.take_off(height_m, duration_s) {
                    Ok(report) => {
                        let here_m = status.state.position_m;
                        let position_m = here_m.with_z(status.ground_m + height_m);
                        let goal = Goal { position_m, yaw_rad: None };
                        self.follow_plan(goal, now_ms, report.duration_s);
                    }
                    Err(refusal) => self.fail(refusal.into(), aircraft),
                }
            }
            _ => {}
        }
    }

    /// Ends a take-off that had begun.
    fn fail<A: Aircraft + ?Sized>(&mut self, reason: PilotRefusal, aircraft: &mut A) {
        self.failure = Some(reason);
        self.task = Task::Rest;
        if !is_in_air(aircraft.status().stage) {
            aircraft.stop();
        }
    }

    /// Follows a plan, unless the aircraft has lost it or another robot is in the way: the flight
    /// then continues by velocities.
    fn follow_or_yield<A: Aircraft + ?Sized>(
        &mut self,
        goal: Goal,
        end_ms: u64,
        status: &AircraftStatus,
        aircraft: &mut A,
        moment: PilotMoment,
    ) {
        // The plan of a robot that has just taken off begins with the next control step.
        let is_new = matches!(status.stage, SupervisorStage::Armed);
        let is_lost =
            status.stage == SupervisorStage::LevelOut || status.reference.is_none() && !is_new;
        let Some(reference) = status.reference.filter(|_| !is_lost) else {
            if is_lost {
                self.task = Task::Approach { goal };
            }
            return;
        };
        if self.avoidance.is_none() || moment.now_ms >= end_ms {
            return;
        }
        let wanted_m_s = reference.velocity_m_s;
        let safe_m_s = self.safe_velocity(wanted_m_s, status, moment.now_ms);
        if safe_m_s.distance(wanted_m_s) > YIELD_M_S {
            self.task = Task::Approach { goal };
            aircraft.fly(&world_velocity(safe_m_s, 0.0));
        }
    }

    /// Lands, unless another robot is in the way.
    fn sink<A: Aircraft + ?Sized>(
        &mut self,
        status: &AircraftStatus,
        aircraft: &mut A,
        moment: PilotMoment,
    ) {
        if status.stage != SupervisorStage::Flying {
            return;
        }
        if self.avoidance.is_some() {
            let wanted_m_s = Vec3::NEG_Z * SINK_M_S;
            let safe_m_s = self.safe_velocity(wanted_m_s, status, moment.now_ms);
            if safe_m_s.distance(wanted_m_s) > YIELD_M_S {
                aircraft.fly(&world_velocity(safe_m_s, 0.0));
                return;
            }
        }
        // An aircraft that lands already refuses, and goes on.
        let _ = aircraft.land(None);
    }

    /// Returns the velocity in m/s that leads to a goal.
    fn approach_velocity(&self, goal: &Goal, status: &AircraftStatus) -> Vec3 {
        let way_m = goal.position_m - status.state.position_m;
        // The robot slows down when it is a second away from the goal.
        let along_m_s =
            (way_m.truncate() * APPROACH_1_S).clamp_length_max(self.settings.approach_m_s);
        along_m_s.extend(self.climb_m_s(goal.position_m.z, status))
    }

    /// Returns the vertical speed in m/s that leads to a height of the center of mass.
    fn climb_m_s(&self, height_m: f32, status: &AircraftStatus) -> f32 {
        let most_m_s = self.settings.limits.climb_m_s;
        ((height_m - status.state.position_m.z) * CLIMB_1_S).clamp(-most_m_s, most_m_s)
    }

    /// Follows a velocity in the frame of the world, as far as it is safe.
    fn fly<A: Aircraft + ?Sized>(
        &mut self,
        wanted_m_s: Vec3,
        turn_rad_s: f32,
        status: &AircraftStatus,
        aircraft: &mut A,
        moment: PilotMoment,
    ) {
        let safe_m_s = self.safe_velocity(wanted_m_s, status, moment.now_ms);
        aircraft.fly(&world_velocity(safe_m_s, turn_rad_s));
    }

    /// Returns the velocity nearest to the wanted one that keeps the robot away from others.
    fn safe_velocity(&mut self, wanted_m_s: Vec3, status: &AircraftStatus, now_ms: u64) -> Vec3 {
        let Some(avoidance) = &mut self.avoidance else { return wanted_m_s };
        let (position_m, velocity_m_s) = (status.state.position_m, status.state.velocity_m_s);
        // The clock of the avoidance wraps.
        avoidance.limit(position_m, velocity_m_s, wanted_m_s, now_ms as u32).velocity_m_s
    }
}

/// Returns a velocity in the frame of the world as a command.
fn world_velocity(velocity_m_s: Vec3, yaw_rate_rad_s: f32) -> VelocityCommand {
    VelocityCommand { frame: VelocityFrame::World, velocity_m_s, yaw_rate_rad_s }
}

fn yaw_rad(status: &AircraftStatus) -> f32 {
    let ahead = status.state.attitude * Vec3::X;
    libm::atan2f(ahead.y, ahead.x)
}
