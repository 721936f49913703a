//! The supervisor, which alone decides if the motors may turn.
//!
//! [`SupervisorLimits::recognize`] turns measurements into [`Conditions`], and [`Supervisor::step`]
//! is a state machine over these. A state machine without numbers has finitely many states, so a
//! model checker explores all of them (`tests/model`).
//!
//! # Rules
//! 1. **A person arms.** Motors start only in the step in which an arm request begins. The
//!    [pilot](crate::pilot) requests to arm with the permission of a person.
//! 2. **One step to off.** An emergency stop, a fault of the IMU and a disarm request stop the
//!    motors in the step that shows them.
//! 3. **A robot that fell stays off.** After a crash a person confirms that the robot is whole,
//!    while it stands upright and still, and arms it again. After a tumble on the ground the robot
//!    has to stand upright and still.
//! 4. **Each flight ends.** A robot without set-points is off within 31 s: it lands with a
//!    position; without one it stays level and sinks, and is off 6 s after it lost the position, or
//!    2 s after the last set-point. A robot that falls does less harm than one that drifts without
//!    control.
//! 5. **A landing is final,** unless nothing but the want of a set-point caused it. When there is one
//!    again, a robot that stays level flies on, and one that lands flies on if it is requested before
//!    the robot is on the ground: by a station that flew it, not by a script. All others land, disarm,
//!    and wait for a person.
//!
//! Outside its fence a robot lands. If it has lost its position too, nothing tells the direction of
//! the flight, so the motors stop.
//!
//! # Transitions
//! Each step takes the first row whose condition holds, or has held for the time in ms. A test
//! reads this table and compares it with the code. *Disarmed* stands for Ready if all checks pass,
//! otherwise for Preflight. *Descent* stands for Landing with a position, and for LevelOut without
//! one.
//!
//! | From | Event | Time | To |
//! |---|---|---|---|
//! | all but Locked | EmergencyStop | | Locked |
//! | all but Locked | ImuFault | | Locked |
//! | Preflight | ChecksPassed | | Ready |
//! | Ready | CheckFailed | | Preflight |
//! | Ready | ArmRequest | | Arming |
//! | Arming, Armed, Flying, Landing, LevelOut, Landed | DisarmRequest | | Disarmed |
//! | Arming, Armed | UpsideDown | 100 | Tumbled |
//! | Arming, Armed | WeightUpwards | 100 | Tumbled |
//! | Arming, Armed | WeightSideways | 1000 | Tumbled |
//! | Arming, Armed | ArmedCheckFailed | | Preflight |
//! | Arming | RotorsIdle | 200 | Armed |
//! | Arming | Timeout | 2000 | Disarmed |
//! | Armed | Lift | | Flying |
//! | Armed | Timeout | 30000 | Disarmed |
//! | Flying, Landing, LevelOut | UpsideDown | 100 | Crashed |
//! | Flying, Landing, LevelOut | WeightUpwards | 100 | Crashed |
//! | Flying, Landing, LevelOut | WeightSideways | 1000 | Crashed |
//! | Flying, Landing, LevelOut | HardLanding | 2 | Landed |
//! | Flying, Landing, LevelOut | Impact | 2 | Crashed |
//! | Flying, Landing, LevelOut | BlockedRotor | 200 | Crashed |
//! | Flying, Landing, LevelOut | NoEffect | 500 | Crashed |
//! | Flying, Landing, LevelOut | SetpointLost | | Locked |
//! | Flying, Landing, LevelOut | OutsideFenceWithoutPosition | 100 | Locked |
//! | Landing, LevelOut | DescentTimeout | 30000 | Locked |
//! | LevelOut | Timeout | 6000 | Locked |
//! | Landing | Ground | 1000 | Landed |
//! | Flying, LevelOut | GroundWithoutLift | 1000 | Landed |
//! | Flying, Landing, LevelOut | NoLift | 2000 | Landed |
//! | Flying | OutsideFence | 100 | Landing |
//! | Flying | BatteryEmpty | 1000 | Descent |
//! | Flying | ScriptFault | | Descent |
//! | Flying | NoSetpoint | | Descent |
//! | Landing | PositionLost | | LevelOut |
//! | Landing | ResumeRequest | | Flying |
//! | LevelOut | SetpointRenewed | | Flying |
//! | LevelOut | PositionRegained | | Landing |
//! | Landed | Timeout | 3000 | Disarmed |
//! | Tumbled | Calm | 1000 | Disarmed |
//! | Crashed | RecoverRequest | 1000 | Disarmed |
//!
//! * `UpsideDown` is about the estimated attitude; `WeightUpwards` and `WeightSideways` are about
//!   the accelerometer, whose times start anew in free fall.
//! * `Lift` is lift that a fresh set-point demands.
//! * `HardLanding` is an impact of an upright robot that lands by itself, or is near the ground.
//!   `NoEffect` is about a robot that something holds, or that does not leave the ground
//!   ([`MotorEffort`]).
//! * `SetpointLost` is an age over 2 s without a position. `NoSetpoint` is an age over 500 ms, or a
//!   set-point that needs a position while there is none.
//! * `SetpointRenewed` applies to a robot that levels out by `NoSetpoint` and has not begun to
//!   land.
//! * `ResumeRequest` applies to a robot that lands by `NoSetpoint`, has a fresh set-point and is not
//!   on the ground.
//! * The time of `RecoverRequest` is that for which the robot stands upright and still.
//! * `CheckFailed` is about every [`PreflightCheck`]. `ArmedCheckFailed` leaves out those that
//!   turning rotors disturb.
//!
//! # Motors
//! | State | Permission |
//! |---|---|
//! | Arming | Idle |
//! | Armed | Follow with a fresh set-point, otherwise Idle |
//! | Flying | Follow |
//! | Landing | Descend |
//! | LevelOut | Level |
//! | all others | Off |

mod conditions;
mod effort;
mod preflight;
mod state;
#[cfg(test)]
mod table;
mod timer;

pub use conditions::{
    Acceleration, BatteryLevel, Conditions, FENCE_MARGIN_M, Inclination, PilotRequests,
    RotorStatus, SETPOINT_LATE_MS, SETPOINT_LOST_MS, SetpointFreshness, SetpointStatus,
    SupervisorInput, SupervisorLimits,
};
pub use effort::MotorEffort;
pub use preflight::{FailedChecks, PreflightCheck};
pub use state::{
    ARMED_TIMEOUT_MS, ARMING_TIMEOUT_MS, CALM_MS, CrashCause, DESCENT_TIMEOUT_MS, Descent,
    GROUND_MS, LANDED_TIMEOUT_MS, LEVEL_OUT_TIMEOUT_MS, LandingCause, LockReason, MotorPermission,
    SupervisorEvent, SupervisorOutput, SupervisorStage, SupervisorState, SupervisorTransition,
};
pub use timer::{FlightMonitor, HoldTimer, TumbleMonitor, TumbleSign};

use state::SupervisorState as State;
use timer::FlightFindings;

/// An event and the state after it.
type Change = (SupervisorEvent, SupervisorState);

/// The state machine that permits or forbids motors.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Supervisor {
    state: SupervisorState,
    /// The last step had an arm request. A request that lasts counts once.
    has_arm_request: bool,
}

impl Default for Supervisor {
    fn default() -> Self {
        Self::new()
    }
}

impl Supervisor {
    /// Returns the supervisor of a robot that was just powered on. An arm request that lasts since
    /// before does not count.
    pub const fn new() -> Self {
        let state = SupervisorState::Preflight(FailedChecks::AT_POWER_ON);
        Supervisor { state, has_arm_request: true }
    }

    /// Returns the present state.
    pub fn state(&self) -> &SupervisorState {
        &self.state
    }

    /// Takes the conditions `elapsed_ms` milliseconds after the last step, and returns what the
    /// flight controller may do until the next one.
    ///
    /// Times in the [table](self#transitions) are exact to the length of a step.
    pub fn step(&mut self, elapsed_ms: u32, now: &Conditions) -> SupervisorOutput {
        let requests = now.requests;
        let is_arm_request = requests.arm && !self.has_arm_request && !requests.disarm;
        self.has_arm_request = requests.arm;
        let change = self.state.advance(elapsed_ms, now, is_arm_request);
        let transition = change.map(|(event, to)| {
            let from = self.state.stage();
            self.state = to;
            SupervisorTransition { from, event, to: to.stage() }
        });
        SupervisorOutput { permission: self.state.permission(now), transition }
    }
}

impl State {
    /// Advances the timers of the state. Returns the change that follows, if there is one.
    fn advance(
        &mut self,
        elapsed_ms: u32,
        now: &Conditions,
        is_arm_request: bool,
    ) -> Option<Change> {
        if matches!(self, State::Locked(_)) {
            return None;
        }
        if now.requests.emergency_stop {
            let to = State::Locked(LockReason::EmergencyStop);
            return Some((SupervisorEvent::EmergencyStop, to));
        }
        if let Some(fault) = now.imu_fault {
            return Some((SupervisorEvent::ImuFault, State::Locked(LockReason::Imu(fault))));
        }
        match self {
            State::Preflight(failed) => {
                match FailedChecks::before_arming(now) {
                    None => return Some((SupervisorEvent::ChecksPassed, State::Ready)),
                    Some(still_failed) => *failed = still_failed,
                }
                None
            }
            State::Ready => match FailedChecks::before_arming(now) {
                Some(failed) => Some((SupervisorEvent::CheckFailed, State::Preflight(failed))),
                None => is_arm_request.then_some((SupervisorEvent::ArmRequest, State::arming())),
            },
            State::Arming { idling, waited, tumble } => {
                let turns = matches!(now.rotors, RotorStatus::Turning | RotorStatus::NotMeasured);
                let has_idled = idling.update(turns, elapsed_ms);
                let is_timeout = waited.update(true, elapsed_ms);
                let sign = tumble.update(elapsed_ms, now);
                on_ground(sign, now).or_else(|| {
                    if has_idled {
                        let to = State::Armed { waited: HoldTimer::started(), tumble: *tumble };
                        return Some((SupervisorEvent::RotorsIdle, to));
                    }
                    is_timeout.then(|| (SupervisorEvent::Timeout, State::disarmed(now)))
                })
            }
            State::Armed { waited, tumble } => {
                let is_timeout = waited.update(true, elapsed_ms);
                let sign = tumble.update(elapsed_ms, now);
                on_ground(sign, now).or_else(|| {
                    if now.has_lift && now.setpoint == SetpointFreshness::Fresh {
                        let to = State::Flying(FlightMonitor::after_ground(*tumble));
                        return Some((SupervisorEvent::Lift, to));
                    }
                    is_timeout.then(|| (SupervisorEvent::Timeout, State::disarmed(now)))
                })
            }
            State::Flying(monitor) => {
                let found = monitor.update(elapsed_ms, now);
                in_air(&found, now, false)
                    .or_else(|| touchdown(found.is_on_ground_without_lift, &found))
                    .or_else(|| reason_to_land(&found, now, *monitor))
            }
            State::Landing { descent, ground, monitor } => {
                let is_timeout = descent.waited.update(true, elapsed_ms);
                let is_on_ground = ground.update(now.is_at_ground, elapsed_ms);
                let found = monitor.update(elapsed_ms, now);
                if let Some(change) =
                    in_air(&found, now, true).or_else(|| descent_timeout(is_timeout))
                {
                    return Some(change);
                }
                if is_on_ground {
                    return Some((SupervisorEvent::Ground, State::landed()));
                }
                touchdown(false, &found).or_else(|| {
                    if !now.has_position {
                        let to = State::level_out(*descent, false, *monitor);
                        return Some((SupervisorEvent::PositionLost, to));
                    }
                    let resumes = now.requests.resume
                        && descent.cause == LandingCause::NoSetpoint
                        && now.setpoint == SetpointFreshness::Fresh
                        && !now.is_at_ground;
                    resumes.then_some((SupervisorEvent::ResumeRequest, State::Flying(*monitor)))
                })
            }
            State::LevelOut { descent, waited, can_resume, monitor } => {
                let is_descent_timeout = descent.waited.update(true, elapsed_ms);
                let is_timeout = waited.update(true, elapsed_ms);
                let found = monitor.update(elapsed_ms, now);
                if let Some(change) =
                    in_air(&found, now, true).or_else(|| descent_timeout(is_descent_timeout))
                {
                    return Some(change);
                }
                if is_timeout {
                    let to = State::Locked(LockReason::LevelOutTimeout);
                    return Some((SupervisorEvent::Timeout, to));
                }
                let is_renewed = *can_resume && now.setpoint == SetpointFreshness::Fresh;
                touchdown(found.is_on_ground_without_lift, &found).or_else(|| {
                    if is_renewed {
                        return Some((SupervisorEvent::SetpointRenewed, State::Flying(*monitor)));
                    }
                    let to = State::landing(*descent, *monitor);
                    now.has_position.then_some((SupervisorEvent::PositionRegained, to))
                })
            }
            State::Landed { waited } => {
                if now.requests.disarm {
                    return Some((SupervisorEvent::DisarmRequest, State::disarmed(now)));
                }
                let is_timeout = waited.update(true, elapsed_ms);
                is_timeout.then(|| (SupervisorEvent::Timeout, State::disarmed(now)))
            }
            State::Tumbled { calm, .. } => {
                let is_calm = calm.update(now.is_calm(), elapsed_ms);
                is_calm.then(|| (SupervisorEvent::Calm, State::disarmed(now)))
            }
            State::Crashed { calm, .. } => {
                let is_calm = calm.update(now.is_calm(), elapsed_ms);
                let recovers = is_calm && now.requests.recover;
                recovers.then(|| (SupervisorEvent::RecoverRequest, State::disarmed(now)))
            }
            State::Locked(_) => None,
        }
    }

    fn arming() -> State {
        State::Arming {
            idling: HoldTimer::default(),
            waited: HoldTimer::started(),
            tumble: TumbleMonitor::default(),
        }
    }

    fn landed() -> State {
        State::Landed { waited: HoldTimer::started() }
    }

    fn disarmed(now: &Conditions) -> State {
        FailedChecks::before_arming(now).map_or(State::Ready, State::Preflight)
    }

    fn landing(descent: Descent, monitor: FlightMonitor) -> State {
        State::Landing { descent, ground: HoldTimer::default(), monitor }
    }

    fn level_out(descent: Descent, can_resume: bool, monitor: FlightMonitor) -> State {
        State::LevelOut { descent, waited: HoldTimer::started(), can_resume, monitor }
    }
}

/// Returns the change of a robot that is armed on the ground and has to stop.
fn on_ground(tumble: Option<TumbleSign>, now: &Conditions) -> Option<Change> {
    if now.requests.disarm {
        return Some((SupervisorEvent::DisarmRequest, State::disarmed(now)));
    }
    if let Some(sign) = tumble {
        return Some((sign.into(), State::Tumbled { sign, calm: HoldTimer::default() }));
    }
    let failed = FailedChecks::while_armed(now)?;
    Some((SupervisorEvent::ArmedCheckFailed, State::Preflight(failed)))
}

/// Returns the change of a robot in the air whose motors have to stop at once.
///
/// `descends`: the robot lands by itself.
fn in_air(found: &FlightFindings, now: &Conditions, descends: bool) -> Option<Change> {
    if now.requests.disarm {
        return Some((SupervisorEvent::DisarmRequest, State::disarmed(now)));
    }
    let crashed = |cause| State::Crashed { cause, calm: HoldTimer::default() };
    if let Some(sign) = found.tumble {
        return Some((sign.into(), crashed(CrashCause::Tumble(sign))));
    }
    if found.has_impact {
        // The height of a robot that lands by itself may be wrong.
        let stands = (now.is_low || descends) && now.inclination == Inclination::Upright;
        return Some(if stands {
            (SupervisorEvent::HardLanding, State::landed())
        } else {
            (SupervisorEvent::Impact, crashed(CrashCause::Impact))
        });
    }
    if found.has_blocked_rotor {
        return Some((SupervisorEvent::BlockedRotor, crashed(CrashCause::BlockedRotor)));
    }
    if found.has_no_effect {
        return Some((SupervisorEvent::NoEffect, crashed(CrashCause::NoEffect)));
    }
    if now.has_position {
        return None;
    }
    if now.setpoint == SetpointFreshness::Lost {
        return Some((SupervisorEvent::SetpointLost, State::Locked(LockReason::SetpointLost)));
    }
    let to = State::Locked(LockReason::OutsideFence);
    found.is_outside_fence.then_some((SupervisorEvent::OutsideFenceWithoutPosition, to))
}

/// Returns the change of a robot that stands on the ground.
fn touchdown(is_on_ground_without_lift: bool, found: &FlightFindings) -> Option<Change> {
    if is_on_ground_without_lift {
        return Some((SupervisorEvent::GroundWithoutLift, State::landed()));
    }
    found.has_no_lift.then(|| (SupervisorEvent::NoLift, State::landed()))
}

/// Returns the change of a robot that follows set-points and has to end its flight.
fn reason_to_land(
    found: &FlightFindings,
    now: &Conditions,
    monitor: FlightMonitor,
) -> Option<Change> {
    let (event, cause) = if found.is_outside_fence {
        (SupervisorEvent::OutsideFence, LandingCause::OutsideFence)
    } else if found.is_battery_empty {
        (SupervisorEvent::BatteryEmpty, LandingCause::BatteryEmpty)
    } else if now.has_script_fault {
        (SupervisorEvent::ScriptFault, LandingCause::ScriptFault)
    } else if now.setpoint != SetpointFreshness::Fresh {
        (SupervisorEvent::NoSetpoint, LandingCause::NoSetpoint)
    } else {
        return None;
    };
    let descent = Descent { cause, waited: HoldTimer::started() };
    let to = if now.has_position {
        State::landing(descent, monitor)
    } else {
        State::level_out(descent, cause == LandingCause::NoSetpoint, monitor)
    };
    Some((event, to))
}

fn descent_timeout(is_timeout: bool) -> Option<Change> {
    let to = State::Locked(LockReason::DescentTimeout);
    is_timeout.then_some((SupervisorEvent::DescentTimeout, to))
}
