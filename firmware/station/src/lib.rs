//! The ground station of a flying Crazyflie: from its packets to commands of the flight controller.
//!
//! [`Station`] joins the ports of Bitcraze's protocol ([`bittybuzz_crtp`]), the order of the sources
//! of commands ([`bittybuzz_flight::arbiter`]) and the [`FlightStack`]. [`ScriptAircraft`] is the
//! flight controller as the script's pilot gets it: without effect while the station is in command.
//!
//! # Principles
//! 1. **A person arms.** The motors start only after a request to arm, which counts for 30 minutes and
//!    ends with every fault ([`Permission`]).
//! 2. **Motors start with a flight.** A robot that a person armed stands still until a set-point leads
//!    upwards or a take-off is commanded.
//! 3. **A silent station keeps nothing alive.** Its commands expire, and the supervisor lands the robot.
//!    A station that comes back before the robot is on the ground continues the flight by its next
//!    set-point or plan; the next flight needs a person again.
//!
//! # Use
//! The caller passes packets to [`Station::receive`]. It executes a command that comes back with
//! [`Station::execute`] on the flight controller or a copy of it, except poses, which are its own to
//! pass on. It calls [`Station::poll`] at least 10 times per second.
//!
//! Not tried on hardware.

#![no_std]
#![forbid(unsafe_code)]

mod high_level;
mod limits;
mod script;
mod setpoint;

pub use limits::OwnerLimit;
pub use script::{ScriptAircraft, ScriptRank};

use bittybuzz_crtp::{
    ArmingRequest, Command, HighLevelCommand, HighLevelOutcome, Identity, LINK_TIMEOUT_MS,
    LogVariable, Packet, Parameters, Ports, Reaction, RefusalCounts, SupervisorInfo, Value,
};
use bittybuzz_flight::arbiter::{
    Arbiter, Arbitration, CommandBlock, CommandSource, Passage, StationCommand,
};
use bittybuzz_flight::pilot::{Permission, PermissionEnd, READY_MS};
use bittybuzz_flight::stack::FlightStack;
use bittybuzz_flight::supervisor::SupervisorStage;

use high_level::Rise;

/// The outcome of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    Done,
    /// Another source of commands is in charge.
    Blocked(CommandBlock),
    /// The robot cannot do that now.
    Refused,
}

impl Outcome {
    fn high_level(self) -> HighLevelOutcome {
        match self {
            Outcome::Done => HighLevelOutcome::Done,
            Outcome::Blocked(_) => HighLevelOutcome::Busy,
            Outcome::Refused => HighLevelOutcome::Refused,
        }
    }
}

/// The moment of a call, and the state of the robot outside of the flight controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StationMoment {
    /// Time in ms.
    pub now_ms: u64,
    /// No sensor or deck keeps the robot from flying.
    pub may_arm: bool,
}

/// A take-off that waits until the motors idle.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Start {
    rise: Rise,
    until_ms: u64,
}

/// A plan that waits until the robot is at rest: a trajectory, or one that ends a landing.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Waiting {
    command: HighLevelCommand,
    until_ms: u64,
}

/// The ground station, as the robot knows it.
#[derive(Clone, Debug)]
pub struct Station {
    ports: Ports,
    arbiter: Arbiter,
    permission: Permission,
    start: Option<Start>,
    waiting: Option<Waiting>,
    /// The time of the last set-point if it led to the ground.
    grounding_ms: Option<u64>,
    /// The time at which the motors stop at the latest, of a robot that lands before it stops.
    stop_due_ms: Option<u64>,
    /// The time of the last packet, once there was one.
    heard_ms: Option<u64>,
    info: SupervisorInfo,
}

impl Station {
    /// Returns the state after power-on: no station, and no person has armed the robot.
    pub fn new(identity: Identity) -> Self {
        Station {
            ports: Ports::new(identity),
            arbiter: Arbiter::new(),
            permission: Permission::Absent,
            start: None,
            waiting: None,
            grounding_ms: None,
            stop_due_ms: None,
            heard_ms: None,
            info: SupervisorInfo::default(),
        }
    }

    /// Handles a packet of the station's radio. Frames of other robots (P2P) do not belong here.
    pub fn receive(&mut self, packet: &[u8], now_ms: u64) -> Reaction {
        self.heard_ms = Some(now_ms);
        self.arbiter.hear_station(now_ms);
        self.ports.receive(packet, now_ms, &self.info)
    }

    /// Executes a command, and returns its answer, if it has one. Poses and notifications have no
    /// effect here.
    pub fn execute(
        &mut self,
        command: &Command,
        stack: &mut FlightStack,
        moment: StationMoment,
    ) -> (Outcome, Option<Packet>) {
        let stage = stack.stage();
        let now_ms = moment.now_ms;
        match command {
            Command::Setpoint(setpoint) => (self.follow(setpoint, stack, now_ms), None),
            Command::SetpointsEnd => {
                let passage =
                    self.arbiter.pass_station(StationCommand::SetpointsEnd, stage, now_ms);
                (self.pass(passage, stack), None)
            }
            Command::HighLevel(command, answer) => {
                let outcome = self.plan(command, stack, now_ms);
                (outcome, Some(answer.packet(outcome.high_level())))
            }
            Command::Arming(request, answer) => {
                let outcome = self.arm(*request, stack, moment);
                self.observe(stack, moment);
                (outcome, Some(answer.packet(outcome == Outcome::Done, &self.info)))
            }
            Command::EmergencyStop => {
                let _ = self.arbiter.pass_station(StationCommand::EmergencyStop, stage, now_ms);
                self.permission.end(PermissionEnd::Person);
                stack.emergency_stop();
                (Outcome::Done, None)
            }
            Command::EmergencyStopWatchdog => {
                let _ = self.arbiter.pass_station(StationCommand::KeepAlive, stage, now_ms);
                (Outcome::Done, None)
            }
            Command::Parameter(_) => (self.restrict(stack), None),
            Command::Localization(_) | Command::Notification { .. } => (Outcome::Done, None),
        }
    }

    /// Keeps a plan of the station in force, continues a take-off, and ends a flight that has landed.
    /// Returns the source in command; after [`CommandSource::EmergencyStop`] the caller stops the
    /// motors until power-on.
    ///
    /// Returns true with it if the flight controller got a command, so that a copy of it has one to
    /// hand over.
    pub fn poll(
        &mut self,
        stack: &mut FlightStack,
        moment: StationMoment,
    ) -> (CommandSource, bool) {
        let (stage, now_ms) = (stack.stage(), moment.now_ms);
        let Arbitration { source, renews } = self.arbiter.poll(stage, now_ms);
        self.watch(stage, now_ms);
        let mut has_command = false;
        if source == CommandSource::EmergencyStop && stage != SupervisorStage::Locked {
            stack.emergency_stop();
            has_command = true;
        }
        // A robot on the ground needs a sign of life to get ready.
        let is_idle = matches!(
            stage,
            SupervisorStage::Preflight | SupervisorStage::Ready | SupervisorStage::Armed
        );
        if renews || self.is_there(now_ms) && (is_idle || stage == SupervisorStage::Arming) {
            stack.renew();
            has_command = true;
        }
        let has_landed = stage == SupervisorStage::Landed
            || stage == SupervisorStage::Flying && stack.has_landed();
        let is_stop_due = self.stop_due_ms.is_some_and(|due_ms| now_ms >= due_ms);
        if has_landed || is_stop_due {
            stack.stop();
            has_command = true;
        }
        if !stack.is_flying() {
            self.stop_due_ms = None;
        }
        if let Some(start) = self.start {
            if now_ms >= start.until_ms || !self.may_start(now_ms) {
                self.start = None;
                // The motors that idle for the take-off stop.
                stack.stop();
            } else if stage == SupervisorStage::Armed {
                self.start = None;
                let _ = self.rise(start.rise, stack, now_ms);
            } else if stage == SupervisorStage::Ready {
                let _ = stack.arm();
            }
            has_command = true;
        }
        if let Some(waiting) = self.waiting {
            let is_due = matches!(source, CommandSource::Station | CommandSource::Supervisor);
            if now_ms >= waiting.until_ms || !is_due {
                self.waiting = None;
            } else if stage == SupervisorStage::Flying && high_level::is_at_rest(stack) {
                self.waiting = None;
                has_command |= self.plan(&waiting.command, stack, now_ms) == Outcome::Done;
            }
        }
        self.observe(stack, moment);
        (source, has_command)
    }

    /// Returns the log packet that is due, if one is.
    pub fn poll_log(
        &mut self,
        now_ms: u64,
        read: impl FnMut(LogVariable) -> Value,
    ) -> Option<Packet> {
        self.ports.poll_log(now_ms, read)
    }

    /// Returns true if a station sent a packet within a second.
    pub fn is_there(&self, now_ms: u64) -> bool {
        self.heard_ms.is_some_and(|heard_ms| now_ms.saturating_sub(heard_ms) <= LINK_TIMEOUT_MS)
    }

    /// Returns the supervisor's state as stations show it.
    pub fn info(&self) -> &SupervisorInfo {
        &self.info
    }

    /// Returns the parameters.
    pub fn parameters(&self) -> &Parameters {
        self.ports.parameters()
    }

    /// Returns the parameters, for the robot to change them.
    pub fn parameters_mut(&mut self) -> &mut Parameters {
        self.ports.parameters_mut()
    }

    /// Returns the counts of packets that were refused.
    pub fn refusals(&self) -> &RefusalCounts {
        self.ports.refusals()
    }

    /// Returns the flight controller as the script's pilot gets it.
    pub fn script_aircraft<'a>(
        &'a mut self,
        stack: &'a mut FlightStack,
        rank: ScriptRank,
        now_ms: u64,
    ) -> ScriptAircraft<'a> {
        ScriptAircraft { arbiter: &mut self.arbiter, stack, rank, now_ms }
    }

    fn arm(
        &mut self,
        request: ArmingRequest,
        stack: &mut FlightStack,
        moment: StationMoment,
    ) -> Outcome {
        match request {
            ArmingRequest::Arm => {
                let may_fly = !matches!(
                    stack.stage(),
                    SupervisorStage::Locked | SupervisorStage::Crashed | SupervisorStage::Tumbled
                );
                if !moment.may_arm || !may_fly {
                    return Outcome::Refused;
                }
                self.permission = Permission::given_at(moment.now_ms);
            }
            ArmingRequest::Disarm => {
                let stage = stack.stage();
                let _ = self.arbiter.pass_station(StationCommand::Stop, stage, moment.now_ms);
                self.permission.end(PermissionEnd::Person);
                self.start = None;
                stack.stop();
            }
            ArmingRequest::Recover => stack.recover(),
        }
        Outcome::Done
    }

    /// Ends the permission as the script's pilot does.
    fn watch(&mut self, stage: SupervisorStage, now_ms: u64) {
        match stage {
            SupervisorStage::Tumbled | SupervisorStage::Crashed => {
                self.permission.end(PermissionEnd::Crash);
            }
            SupervisorStage::Locked | SupervisorStage::Landing => {
                self.permission.end(PermissionEnd::Fault);
            }
            _ => {}
        }
        self.permission.expire(now_ms);
    }

    /// Returns true if a person permits to start the motors.
    fn may_start(&self, now_ms: u64) -> bool {
        let mut permission = self.permission;
        permission.expire(now_ms);
        matches!(permission, Permission::Given { .. })
    }

    /// Begins a start, for which the motors have to idle first.
    fn start(&mut self, rise: Rise, stack: &mut FlightStack, now_ms: u64) -> Outcome {
        if !self.may_start(now_ms) {
            return Outcome::Refused;
        }
        self.start = Some(Start { rise, until_ms: now_ms + READY_MS });
        // A robot that is not ready yet is asked again by `poll`.
        let _ = stack.arm();
        Outcome::Done
    }

    /// Applies the arbiter's decision about a command that needs no plan of its own.
    fn pass(&mut self, passage: Result<Passage, CommandBlock>, stack: &mut FlightStack) -> Outcome {
        match passage {
            Err(block) => Outcome::Blocked(block),
            Ok(Passage::Hover) => outcome(stack.hover()),
            Ok(Passage::Execute | Passage::Ignore | Passage::Resume) => Outcome::Done,
        }
    }

    fn observe(&mut self, stack: &FlightStack, moment: StationMoment) {
        let stage = stack.stage();
        let is_flying = stack.is_flying();
        let is_permitted = self.may_start(moment.now_ms);
        let is_ready = matches!(stage, SupervisorStage::Ready | SupervisorStage::Preflight);
        let is_plan = stack.reference().is_some();
        self.info = SupervisorInfo {
            can_be_armed: moment.may_arm && is_ready,
            is_armed: is_permitted || is_flying,
            is_auto_armed: false,
            can_fly: is_flying || is_permitted && moment.may_arm,
            is_flying,
            is_tumbled: stage == SupervisorStage::Tumbled,
            is_locked: stage == SupervisorStage::Locked,
            is_crashed: stage == SupervisorStage::Crashed,
            is_plan_active: is_plan,
            is_plan_finished: !is_plan,
            is_plan_disabled: false,
            has_deck_fault: false,
        };
    }
}

/// Takes the robot back from the supervisor, which may have another reason to land it.
fn resume(stack: &mut FlightStack) -> Outcome {
    let landing = Outcome::Blocked(CommandBlock::Outranked(CommandSource::Supervisor));
    stack.resume().map_or(landing, |()| Outcome::Done)
}

/// Returns the outcome of a command that the flight controller got.
fn outcome<T, E>(result: Result<T, E>) -> Outcome {
    if result.is_ok() { Outcome::Done } else { Outcome::Refused }
}
