//! The pilot: from the flight functions of a script to commands of the flight controller.
//!
//! A [`Pilot`] executes the functions of the robot file that fly: `takeoff`, `goTo` and so on
//! ([`PilotFunction`]). It flies any [`Aircraft`]: the [`FlightStack`](crate::stack::FlightStack),
//! or a [`PlannedAircraft`], which has a planner and no controller. The simulator, in both its
//! fidelities, and the benchmark on the chip fly by this module alone, so a function has the same
//! duration, limits and results everywhere. The firmware does not fly yet.
//!
//! The caller passes on each call of the script with [`Pilot::call`], again until it no longer
//! waits, and calls [`Pilot::tick`] 10 times per second after the script.
//!
//! # Permission
//! A script never arms. A person gives a [`Permission`] ([`Pilot::permit`]); only with it the pilot
//! requests to arm when the script takes off. It lasts until a fault of the script, a landing by
//! the supervisor, a tumble or crash, a low battery, or for half an hour. A landing by the script
//! keeps it.
//!
//! # Ways to fly
//! * `takeoff`, `land` and `goTo` follow a plan in the shortest time that the limits allow.
//! * `goto` and the functions without a place follow a velocity, which is renewed in each tick, so
//!   that a script can change its goal in each step.
//!
//! The collision avoidance limits velocities. With it, `goTo` follows velocities too, and a take-off
//! or landing that another robot blocks continues by velocities.

mod aircraft;
mod function;
mod permission;
mod planned;
mod refusal;
mod settings;
#[cfg(test)]
mod tests;

pub use aircraft::{Aircraft, AircraftStatus};
pub use function::PilotFunction;
pub use permission::{Permission, PermissionEnd};
pub use planned::{BodyVelocity, PlannedAircraft};
pub use refusal::PilotRefusal;
pub use settings::{
    ARRIVAL_MS, EMPTY_MS, PERMISSION_MS, PilotSettings, READY_MS, SPIN_MS, TOUCHDOWN_MS,
};

use glam::{Vec2, Vec3};

use crate::avoidance::{Avoidance, PeerReport, RefusedReport};
use crate::planner::{Destination, PlanError, VelocityCommand, VelocityFrame, wrapped};
use crate::supervisor::SupervisorStage;
use function::FlightRequest;

/// Reports of other robots that the collision avoidance keeps.
pub const PEERS: usize = 10;
/// Speed per distance from a goal in 1/s: horizontally, vertically and of the yaw.
const APPROACH_1_S: f32 = 1.0;
const CLIMB_1_S: f32 = 2.0;
const FACE_1_S: f32 = 1.0;
/// Time in seconds that an approach by velocities takes in addition to the way at full speed, until
/// the rest of the way is 5 cm: the last half meter takes ln 10 s.
const APPROACH_S: f32 = 1.5;
/// Change of a velocity in m/s from which a plan is in the way of another robot.
const YIELD_M_S: f32 = 0.02;
/// Vertical speed in m/s of a landing that gave way to another robot.
const SINK_M_S: f32 = 0.3;

/// The moment of a call.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PilotMoment {
    /// Time in ms.
    pub now_ms: u64,
    /// Voltage of the battery in mV.
    pub battery_mv: u16,
}

/// The answer to a call.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PilotAnswer {
    /// The script waits; the caller repeats the call.
    Waiting,
    /// The function is done: true if the robot is there. [`PilotFunction::has_value`] is true if the
    /// script receives this as 1 or 0.
    Done(bool),
    /// An argument is outside the range of the function.
    OutOfRange,
    /// The pilot refused; the script receives 0 or nil.
    Refused {
        /// The reason.
        reason: PilotRefusal,
        /// False if the last call of this function was refused for the same reason, so that a log
        /// has it.
        is_new: bool,
    },
}

/// A place to fly to.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Goal {
    position_m: Vec3,
    yaw_rad: Option<f32>,
}

/// The task until the next call.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Task {
    /// Stand on the ground, or wait until the supervisor has ended the flight.
    #[default]
    Rest,
    /// Arm and take off.
    Start { height_m: f32, pace_m_s: Option<f32>, until_ms: u64 },
    /// Follow the plan that the aircraft has.
    Plan { goal: Goal, end_ms: u64 },
    /// Fly to a place by velocities.
    Approach { goal: Goal },
    /// Fly with this velocity in the robot's frame at a height above the ground of the world.
    Cruise { forward_m_s: f32, left_m_s: f32, turn_rad_s: f32, height_m: f32 },
    /// Land and stop the motors.
    Land,
}

/// The pilot of one robot.
#[derive(Clone, Debug)]
pub struct Pilot {
    settings: PilotSettings,
    permission: Permission,
    avoidance: Option<Avoidance<PEERS>>,
    task: Task,
    /// Height in m above the ground of the world, at which functions without a height fly.
    height_m: f32,
    /// Time in ms at which the function for which the script waits ends.
    wait_until_ms: u64,
    /// Time in ms since which the battery has been empty.
    empty_since_ms: Option<u64>,
    has_script_fault: bool,
    /// The reason why a take-off that had begun ended.
    failure: Option<PilotRefusal>,
    /// The reason why the last call of each function was refused.
    refusals: [Option<PilotRefusal>; PilotFunction::ALL.len()],
}

impl Pilot {
    /// Returns the pilot of a robot that was just switched on, without a permission.
    #[must_use]
    pub fn new(settings: PilotSettings) -> Self {
        Pilot {
            settings,
            permission: Permission::Absent,
            avoidance: None,
            task: Task::Rest,
            height_m: 0.0,
            wait_until_ms: 0,
            empty_since_ms: None,
            has_script_fault: false,
            failure: None,
            refusals: [None; PilotFunction::ALL.len()],
        }
    }

    /// Switches the collision avoidance on, or off with `None`.
    pub fn set_avoidance(&mut self, avoidance: Option<Avoidance<PEERS>>) {
        self.avoidance = avoidance;
    }

    /// Returns true if the collision avoidance is on.
    #[must_use]
    pub fn has_avoidance(&self) -> bool {
        self.avoidance.is_some()
    }

    /// Takes the permission of a person to start the motors.
    pub fn permit(&mut self, now_ms: u64) {
        self.permission = Permission::given_at(now_ms);
    }

    /// Returns the permission of a person.
    #[must_use]
    pub fn permission(&self) -> Permission {
        self.permission
    }

    /// Sets if a fault has stopped the script and it has not restarted. The robot lands.
    pub fn set_script_fault(&mut self, has_fault: bool) {
        self.has_script_fault = has_fault;
        if has_fault {
            self.permission.end(PermissionEnd::ScriptFault);
        }
    }

    /// Passes the report of another robot to the aircraft, which does not adopt a pose there, and to
    /// the collision avoidance, if there is one.
    ///
    /// # Errors
    /// Returns what [`Avoidance::update_peer`] refuses.
    pub fn update_peer<A: Aircraft + ?Sized>(
        &mut self,
        report: PeerReport,
        aircraft: &mut A,
    ) -> Result<(), RefusedReport> {
        aircraft.hear_peer(report.position_m);
        self.avoidance.as_mut().map_or(Ok(()), |avoidance| avoidance.update_peer(report))
    }

    /// Executes a call of the script. `numbers` are its arguments as in the robot file: mm, mm/s,
    /// degrees per second and steps. `is_repeated` is true after [`PilotAnswer::Waiting`].
    pub fn call<A: Aircraft + ?Sized>(
        &mut self,
        function: PilotFunction,
        numbers: &[f32],
        is_repeated: bool,
        aircraft: &mut A,
        moment: PilotMoment,
    ) -> PilotAnswer {
        let request = function.request(numbers, &self.settings);
        let answer = if !numbers.iter().all(|number| number.is_finite()) {
            Err(PilotRefusal::Plan(PlanError::NotFinite))
        } else if is_repeated {
            self.poll(&request, aircraft, moment)
        } else {
            self.begin(&request, aircraft, moment)
        };
        let before = core::mem::replace(&mut self.refusals[function as usize], answer.err());
        match answer {
            Ok(answer) => answer,
            Err(reason) => PilotAnswer::Refused { reason, is_new: before != Some(reason) },
        }
    }

    /// Flies on, after the script's step.
    pub fn tick<A: Aircraft + ?Sized>(&mut self, aircraft: &mut A, moment: PilotMoment) {
        aircraft.set_script_fault(self.has_script_fault);
        self.permission.expire(moment.now_ms);
        self.watch_stage(aircraft);
        self.watch_battery(aircraft, moment);
        self.follow(aircraft, moment);
        aircraft.renew();
    }

    /// Begins a function.
    fn begin<A: Aircraft + ?Sized>(
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
    fn poll<A: Aircraft + ?Sized>(
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

    fn land<A: Aircraft + ?Sized>(&mut self, pace_m_s: Option<f32>, aircraft: &mut A, now_ms: u64) {
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
    fn follow_plan(&mut self, goal: Goal, now_ms: u64, duration_s: f32) {
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

    fn require_permission(&mut self, now_ms: u64) -> Result<(), PilotRefusal> {
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

    /// Reacts to what the supervisor did.
    fn watch_stage<A: Aircraft + ?Sized>(&mut self, aircraft: &mut A) {
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
    fn watch_battery<A: Aircraft + ?Sized>(&mut self, aircraft: &mut A, moment: PilotMoment) {
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
    fn follow<A: Aircraft + ?Sized>(&mut self, aircraft: &mut A, moment: PilotMoment) {
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

fn milliseconds(seconds: f32) -> u64 {
    // A conversion from f32 saturates, and a duration is at most half an hour.
    (seconds * 1000.0) as u64
}

fn is_in_air(stage: SupervisorStage) -> bool {
    matches!(stage, SupervisorStage::Flying | SupervisorStage::Landing | SupervisorStage::LevelOut)
}
