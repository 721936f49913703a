//! The pilot: from the flight functions of a script to commands of the flight controller.
//!
//! A [`Pilot`] executes the functions of the robot file that fly: `takeoff`, `goTo` and so on
//! ([`PilotFunction`]). It flies any [`Aircraft`]: the [`FlightStack`](crate::stack::FlightStack),
//! or a [`PlannedAircraft`], which has a planner and no controller. The simulator, in both its
//! fidelities, the firmware and the benchmark on the chip fly by this module alone, so a function has the same
//! duration, limits and results everywhere. On a robot it commands a copy of the flight controller
//! ([`FlightStack::plan_elsewhere`](crate::stack::FlightStack::plan_elsewhere)).
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
mod calls;
mod function;
mod permission;
mod planned;
mod refusal;
mod settings;
mod tasks;
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

use glam::Vec3;

use crate::avoidance::{Avoidance, Obstacle, PeerReport, RefusedReport};
use crate::planner::PlanError;
use crate::supervisor::SupervisorStage;

/// Reports of other robots that the collision avoidance keeps.
pub const PEERS: usize = 10;

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

    /// Gives the collision avoidance, if there is one, the obstacles around the robot; see
    /// [`Avoidance::set_obstacles`].
    pub fn set_obstacles(&mut self, obstacles: impl IntoIterator<Item = Obstacle>) {
        if let Some(avoidance) = &mut self.avoidance {
            avoidance.set_obstacles(obstacles);
        }
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

    /// Ends the permission, since a person disarmed the robot. The caller stops the motors.
    pub fn forbid(&mut self) {
        self.permission.end(PermissionEnd::Person);
        self.task = Task::Rest;
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
}

fn is_in_air(stage: SupervisorStage) -> bool {
    matches!(stage, SupervisorStage::Flying | SupervisorStage::Landing | SupervisorStage::LevelOut)
}
