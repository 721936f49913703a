//! The supervisor of a flight, explored with every order of conditions.
//!
//! The supervisor is no model: each transition is a step of the code that decides on a robot. An
//! action is one step under conditions that differ from those of a robot at rest, or in flight, by
//! a few changes. Properties are stated about conditions and permissions; the stage is read only
//! for crashes.

use std::fmt::Debug;
use std::hash::Hash;
use std::marker::PhantomData;

use bittybuzz_flight::calibration::ImuFault;
use bittybuzz_flight::supervisor::{
    Acceleration, BatteryLevel, Conditions, Inclination, MotorPermission, RotorStatus,
    SetpointFreshness, Supervisor, SupervisorStage,
};
use stateright::{Model, Property};

/// A supervisor under test: the real one, or one with a fault.
pub trait Supervision: Copy + Debug + Eq + Hash + Send + Sync + 'static {
    /// Returns the supervisor of a robot that was just powered on.
    fn power_on() -> Self;
    /// Takes a step and returns what it permits.
    fn step(&mut self, elapsed_ms: u32, now: &Conditions) -> MotorPermission;
    /// Returns the stage that the supervisor reports.
    fn stage(&self) -> SupervisorStage;
}

impl Supervision for Supervisor {
    fn power_on() -> Self {
        Supervisor::new()
    }

    fn step(&mut self, elapsed_ms: u32, now: &Conditions) -> MotorPermission {
        Supervisor::step(self, elapsed_ms, now).permission
    }

    fn stage(&self) -> SupervisorStage {
        self.state().stage()
    }
}

/// A rule that a step broke.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Breach {
    StartWithoutPerson,
    StartDespiteChecks,
    MotorsAfterRequestToStop,
    MotorsDespiteImuFault,
    MotorsWhileLocked,
    MotorsBeforeRecovery,
    MotorsUpsideDown,
    MotorsWithoutSetpointAndPosition,
    FollowsOldSetpoint,
    FollowsDuringFinalLanding,
    DescendsWithoutPosition,
}

/// A supervisor after some steps, and what an observer remembers of them.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct SupervisedFlight<S> {
    pub supervisor: S,
    permission: MotorPermission,
    /// The last step had an arm request.
    had_arm_request: bool,
    /// The last step was upside down, with motors on after it.
    was_upside_down: bool,
    /// An emergency stop or a fault of the IMU occurred.
    is_locked: bool,
    /// The robot crashed, and no recovery has been confirmed since.
    needs_recovery: bool,
    /// The robot descends by itself for another cause than the want of a set-point.
    lands_finally: bool,
    pub breach: Option<Breach>,
}

impl<S: Supervision> SupervisedFlight<S> {
    fn power_on() -> Self {
        SupervisedFlight {
            supervisor: S::power_on(),
            permission: MotorPermission::Off,
            had_arm_request: true,
            was_upside_down: false,
            is_locked: false,
            needs_recovery: false,
            lands_finally: false,
            breach: None,
        }
    }

    fn step(&mut self, elapsed_ms: u32, now: &Conditions) {
        let requests = now.requests;
        let permission = self.supervisor.step(elapsed_ms, now);
        let is_calm = now.is_still && now.inclination == Inclination::Upright;
        self.is_locked |= requests.emergency_stop || now.imu_fault.is_some();
        self.needs_recovery &= !(requests.recover && is_calm);
        self.breach = self.breach_of(elapsed_ms, now, permission);

        let descends = matches!(permission, MotorPermission::Descend | MotorPermission::Level);
        let begins = self.permission == MotorPermission::Follow;
        let has_other_cause = now.setpoint == SetpointFreshness::Fresh || now.has_script_fault;
        self.lands_finally = descends && (self.lands_finally || begins && has_other_cause);
        self.permission = permission;
        self.had_arm_request = requests.arm;
        self.was_upside_down =
            permission.allows_motors() && now.inclination == Inclination::UpsideDown;
        self.needs_recovery |= self.supervisor.stage() == SupervisorStage::Crashed;
    }

    /// Returns the rule that motors break, if they get this permission.
    fn breach_of(
        &self,
        elapsed_ms: u32,
        now: &Conditions,
        permission: MotorPermission,
    ) -> Option<Breach> {
        if !permission.allows_motors() {
            return None;
        }
        let requests = now.requests;
        let starts = !self.permission.allows_motors();
        let is_upside_down = now.inclination == Inclination::UpsideDown;
        let passes_checks = now.is_calibrated
            && now.is_still
            && now.inclination == Inclination::Upright
            && now.battery == BatteryLevel::Good
            && !now.is_outside_fence
            && !now.has_script_fault;
        let resumes = requests.resume && !now.is_at_ground;
        let breaches = [
            (requests.emergency_stop || requests.disarm, Breach::MotorsAfterRequestToStop),
            (now.imu_fault.is_some(), Breach::MotorsDespiteImuFault),
            (self.is_locked, Breach::MotorsWhileLocked),
            (self.needs_recovery, Breach::MotorsBeforeRecovery),
            (starts && (!requests.arm || self.had_arm_request), Breach::StartWithoutPerson),
            (starts && !passes_checks, Breach::StartDespiteChecks),
            (self.was_upside_down && is_upside_down && elapsed_ms >= 100, Breach::MotorsUpsideDown),
            (
                now.setpoint == SetpointFreshness::Lost && !now.has_position,
                Breach::MotorsWithoutSetpointAndPosition,
            ),
            (
                now.setpoint != SetpointFreshness::Fresh && permission == MotorPermission::Follow,
                Breach::FollowsOldSetpoint,
            ),
            (
                permission == MotorPermission::Follow
                    && (self.lands_finally
                        || self.permission == MotorPermission::Descend && !resumes),
                Breach::FollowsDuringFinalLanding,
            ),
            (
                !now.has_position && permission == MotorPermission::Descend,
                Breach::DescendsWithoutPosition,
            ),
        ];
        breaches.into_iter().find(|(is_broken, _)| *is_broken).map(|(_, breach)| breach)
    }

    /// Returns true if motors are off after 31 s without set-points, in the air, with a position,
    /// without one, and with one that comes and goes.
    fn ends_in_silence(&self) -> bool {
        let silent = Conditions { setpoint: SetpointFreshness::Lost, ..in_flight() };
        let blind = Conditions { has_position: false, ..silent };
        // A robot without a position is off at once if its set-point is lost, so it is only late
        // here.
        let late = Conditions { setpoint: SetpointFreshness::Late, ..blind };
        [[silent, silent], [blind, blind], [silent, late]].iter().all(|pair| {
            let mut supervisor = self.supervisor;
            let mut permission = self.permission;
            for second in 0..=31 {
                permission = supervisor.step(1000, &pair[second % 2]);
            }
            !permission.allows_motors()
        })
    }

    /// Returns true if a person gets the robot ready: disarm it, put it down, confirm that it is
    /// whole.
    fn can_become_ready(&self) -> bool {
        let mut supervisor = self.supervisor;
        let mut now = Conditions::AT_REST;
        now.requests.disarm = true;
        supervisor.step(1000, &now);
        now.requests.disarm = false;
        now.requests.recover = true;
        for _ in 0..4 {
            supervisor.step(1000, &now);
        }
        supervisor.stage() == SupervisorStage::Ready
    }
}

/// Bounds of the exploration.
#[derive(Clone, Debug)]
pub struct FlightBounds<S> {
    elapsed_ms: &'static [u32],
    conditions: Vec<Conditions>,
    supervisor: PhantomData<S>,
}

/// Returns the conditions of a robot that flies.
fn in_flight() -> Conditions {
    Conditions {
        is_still: false,
        has_lift: true,
        is_at_ground: false,
        is_low: false,
        ..Conditions::AT_REST
    }
}

/// A change of conditions.
pub type Change = fn(&mut Conditions);

/// Requests of a person.
pub const REQUESTS: &[Change] = &[
    |now| now.requests.arm = true,
    |now| now.requests.disarm = true,
    |now| now.requests.recover = true,
    |now| now.requests.emergency_stop = true,
    |now| now.requests.resume = true,
];

/// Signs of a robot that falls.
pub const FALLS: &[Change] = &[
    |now| now.inclination = Inclination::Tilted,
    |now| now.inclination = Inclination::UpsideDown,
    |now| now.acceleration = Acceleration::Sideways,
    |now| now.acceleration = Acceleration::Upwards,
    |now| now.acceleration = Acceleration::FreeFall,
    |now| now.is_still = !now.is_still,
    |now| now.has_impact = true,
    |now| now.is_low = !now.is_low,
    |now| now.is_vain = true,
    |now| now.rotors = RotorStatus::Slow,
    |now| now.rotors = RotorStatus::Blocked,
];

/// Losses that end a flight by a descent.
pub const LOSSES: &[Change] = &[
    |now| now.has_position = false,
    |now| now.setpoint = SetpointFreshness::Late,
    |now| now.setpoint = SetpointFreshness::Lost,
    |now| now.has_script_fault = true,
    |now| now.is_outside_fence = true,
];

/// Changes that are in none of the other lists.
pub const OTHERS: &[Change] = &[
    |now| now.imu_fault = Some(ImuFault::Silent),
    |now| now.is_calibrated = false,
    |now| now.has_lift = !now.has_lift,
    |now| now.is_at_ground = !now.is_at_ground,
    |now| now.battery = BatteryLevel::Low,
    |now| now.battery = BatteryLevel::Empty,
];

impl<S: Supervision> FlightBounds<S> {
    /// Returns bounds with steps of any of these lengths, under the conditions at rest or in flight
    /// with none, one, or two of these changes.
    pub fn new(elapsed_ms: &'static [u32], lists: &[&[Change]]) -> Self {
        let changes = lists.concat();
        let mut conditions = Vec::new();
        let mut add = |now| {
            if !conditions.contains(&now) {
                conditions.push(now);
            }
        };
        for usual in [Conditions::AT_REST, in_flight()] {
            add(usual);
            for (index, first) in changes.iter().enumerate() {
                for second in &changes[index..] {
                    // The same change twice would undo some of them.
                    let mut now = usual;
                    first(&mut now);
                    add(now);
                    second(&mut now);
                    add(now);
                }
            }
        }
        FlightBounds { elapsed_ms, conditions, supervisor: PhantomData }
    }
}

/// Name of the property that no step breaks a rule.
pub const RULES_HOLD: &str = "motors obey the rules in every step";
/// Name of the property that flights end.
pub const SILENCE_ENDS: &str = "motors stop 31 s after the last set-point";
/// Name of the property that no state is a dead end.
pub const READY_AGAIN: &str = "a person can get every robot ready that is not locked";
/// Name of the property that a lock lasts.
pub const LOCK_LASTS: &str = "an emergency stop and an IMU fault lock the robot";

/// Names of the properties that hold in every state.
pub const ALWAYS: [&str; 4] = [RULES_HOLD, SILENCE_ENDS, READY_AGAIN, LOCK_LASTS];

impl<S: Supervision> Model for FlightBounds<S> {
    type State = SupervisedFlight<S>;
    type Action = (u32, Conditions);

    fn init_states(&self) -> Vec<Self::State> {
        vec![SupervisedFlight::power_on()]
    }

    fn actions(&self, flight: &Self::State, actions: &mut Vec<Self::Action>) {
        if flight.breach.is_some() {
            return;
        }
        for elapsed_ms in self.elapsed_ms {
            actions.extend(self.conditions.iter().map(|now| (*elapsed_ms, *now)));
        }
    }

    fn next_state(
        &self,
        flight: &Self::State,
        (elapsed_ms, now): Self::Action,
    ) -> Option<Self::State> {
        let mut next = flight.clone();
        next.step(elapsed_ms, &now);
        (next != *flight).then_some(next)
    }

    fn properties(&self) -> Vec<Property<Self>> {
        use SupervisorStage as Stage;
        vec![
            Property::always(RULES_HOLD, |_, flight: &Self::State| flight.breach.is_none()),
            Property::always(SILENCE_ENDS, |_, flight: &Self::State| flight.ends_in_silence()),
            Property::always(READY_AGAIN, |_, flight: &Self::State| {
                is_in(flight, Stage::Locked) || flight.can_become_ready()
            }),
            Property::always(LOCK_LASTS, |_, flight: &Self::State| {
                !flight.is_locked || is_in(flight, Stage::Locked)
            }),
            Property::sometimes("preflight", |_, flight| is_in(flight, Stage::Preflight)),
            Property::sometimes("ready", |_, flight| is_in(flight, Stage::Ready)),
            Property::sometimes("arming", |_, flight| is_in(flight, Stage::Arming)),
            Property::sometimes("armed", |_, flight| is_in(flight, Stage::Armed)),
            Property::sometimes("flying", |_, flight| is_in(flight, Stage::Flying)),
            Property::sometimes("landing", |_, flight| is_in(flight, Stage::Landing)),
            Property::sometimes("level-out", |_, flight| is_in(flight, Stage::LevelOut)),
            Property::sometimes("landed", |_, flight| is_in(flight, Stage::Landed)),
            Property::sometimes("tumbled", |_, flight| is_in(flight, Stage::Tumbled)),
            Property::sometimes("crashed", |_, flight| is_in(flight, Stage::Crashed)),
            Property::sometimes("locked", |_, flight| is_in(flight, Stage::Locked)),
        ]
    }
}

fn is_in<S: Supervision>(flight: &SupervisedFlight<S>, stage: SupervisorStage) -> bool {
    flight.supervisor.stage() == stage
}
