//! Plans elsewhere: a copy of the flight controller takes the commands, and hands them over.
//!
//! The search for a plan takes up to 0.8 ms on a Crazyflie, and a tick has to end 0.95 ms after its
//! sample. [`FlightStack::plan_elsewhere`] therefore keeps searches out of the ticks. Between two
//! ticks the owner
//!
//! 1. copies the controller, and gives the copy to a task of lower priority. That task commands the
//!    copy as it would command the controller itself, and calls [`FlightStack::plan_what_is_due`].
//! 2. takes the commands back with [`FlightStack::take_commands`], and discards the copy.
//!
//! Between a copy and its return the controller flies on by its last plan. A copy is a few
//! milliseconds older than the controller, so a plan begins that much in the past; it begins from the
//! reference of that moment, so the reference does not jump.
//!
//! A plan that the supervisor needs is due from the tick in which the supervisor changes its state.
//! If no copy brings it in time, the next tick makes it, late or not.

use super::{FlightStack, StackSettings};
use crate::supervisor::{MotorPermission, PilotRequests};

/// Ticks after which the owner renews the copy, even if nothing was commanded.
pub const COPY_TICKS: u32 = 20;

/// Time in ms after which a tick makes a plan that is due itself.
const PLAN_LATE_MS: u64 = 50;

/// The bookkeeping of commands and plans that a copy may have made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct PlanningDesk {
    /// Ticks leave searches to a copy.
    is_elsewhere: bool,
    /// Time in ms from which on a plan to land is due.
    landing_due_ms: Option<u64>,
    /// Number of commands, of changes of the planner by commands, and of changes of the permission.
    commands: u32,
    plans: u32,
    permissions: u32,
}

impl PlanningDesk {
    /// Notes a command.
    pub fn note_command(&mut self) {
        self.commands = self.commands.wrapping_add(1);
    }

    /// Notes a change of the planner by a command.
    pub fn note_plan(&mut self) {
        self.plans = self.plans.wrapping_add(1);
        self.landing_due_ms = None;
    }

    /// Notes another permission, which may drop the plan.
    pub fn note_permission(&mut self) {
        self.permissions = self.permissions.wrapping_add(1);
        self.landing_due_ms = None;
    }
}

impl FlightStack {
    /// Leaves the search for plans to a copy of this controller from now on.
    pub fn plan_elsewhere(&mut self) {
        self.desk.is_elsewhere = true;
        if let Some(planner) = &mut self.planner {
            planner.defer_retries(true);
        }
    }

    /// Returns true if a copy has to [plan](Self::plan_what_is_due).
    #[must_use]
    pub fn is_plan_due(&self) -> bool {
        let retries = self.planner.as_ref().is_some_and(|planner| planner.is_retry_due());
        self.desk.landing_due_ms.is_some() || retries
    }

    /// Makes the plans that are due.
    pub fn plan_what_is_due(&mut self) {
        if self.desk.landing_due_ms.is_some() {
            self.plan_landing();
            self.desk.note_plan();
        }
        let now_s = self.now_s();
        if let Some(planner) = self.planner.as_mut().filter(|planner| planner.is_retry_due()) {
            // The search begins at the reference of this moment.
            let _ = planner.reference(now_s);
            planner.retry_now();
            self.desk.note_plan();
        }
    }

    /// Takes the commands that a copy of this controller has received. A plan is dropped if the
    /// supervisor has changed the permission meanwhile, since it may have ended the flight.
    pub fn take_commands(&mut self, copy: &FlightStack) {
        let PilotRequests { arm, disarm, recover, emergency_stop, resume } = copy.requests;
        self.requests.arm |= arm;
        self.requests.disarm |= disarm;
        self.requests.recover |= recover;
        self.requests.emergency_stop |= emergency_stop;
        self.requests.resume |= resume;
        self.has_script_fault = copy.has_script_fault;
        self.peers = copy.peers;
        self.command_ms = self.command_ms.max(copy.command_ms);
        let is_current = copy.desk.permissions == self.desk.permissions;
        if disarm || is_current && copy.desk.commands != self.desk.commands {
            self.guidance = copy.guidance;
            self.command_ms = copy.command_ms;
        }
        if is_current && copy.desk.plans != self.desk.plans {
            self.planner = copy.planner;
            self.desk.landing_due_ms = copy.desk.landing_due_ms;
        }
        let StackSettings { limits, fence, supervision, .. } = copy.settings;
        self.settings.supervision = supervision;
        if (limits, fence) != (self.settings.limits, self.settings.fence) {
            // The copy has refused limits that are not valid.
            let _ = self.restrict(limits, fence);
        }
        self.desk.commands = copy.desk.commands;
        self.desk.plans = copy.desk.plans;
    }

    /// Plans the landing that the supervisor has begun, now or elsewhere.
    pub(super) fn begin_landing(&mut self) {
        if self.desk.is_elsewhere {
            self.desk.landing_due_ms = Some(self.now_ms());
        } else {
            self.plan_landing();
        }
    }

    /// Makes a plan that is due and that no copy has brought in time.
    pub(super) fn plan_if_late(&mut self) {
        let is_late = |since_ms: u64| self.now_ms() >= since_ms + PLAN_LATE_MS;
        if self.desk.landing_due_ms.is_some_and(is_late) {
            self.desk.landing_due_ms = None;
            self.plan_landing();
        }
    }

    fn plan_landing(&mut self) {
        if self.permission != MotorPermission::Descend {
            return;
        }
        let state = self.filter.state();
        let (now_s, ground_m) = (self.now_s(), self.ground_m);
        // Without a plan to land from the robot sinks. A planner that lands already goes on.
        let _ = self.start_in_air(&state, now_s);
        if let Some(planner) = &mut self.planner {
            let _ = planner.land(now_s, ground_m, None);
        }
    }
}
