//! The supervisor's states, what they permit, and the events between them.

use crate::calibration::ImuFault;

use super::conditions::{Conditions, SetpointFreshness};
use super::preflight::FailedChecks;
use super::timer::{FlightMonitor, HoldTimer, TumbleMonitor, TumbleSign};

/// Time in ms after which rotors that do not idle end the start.
pub const ARMING_TIMEOUT_MS: u16 = 2000;
/// Time in ms on the ground after which an armed robot disarms.
pub const ARMED_TIMEOUT_MS: u16 = 30_000;
/// Time in ms after which a descent that does not reach the ground ends with the motors off. A
/// robot that sinks at 0.5 m/s lands from 15 m.
pub const DESCENT_TIMEOUT_MS: u16 = 30_000;
/// Time in ms for which a robot without a position stays level and sinks: 3.6 s from 2 m to 0.2 m at
/// 0.5 m/s, a second at 0.2 m/s, and the rest until a robot on the ground is recognized.
pub const LEVEL_OUT_TIMEOUT_MS: u16 = 6000;
/// Time in ms after which a robot that landed is ready for the next flight.
pub const LANDED_TIMEOUT_MS: u16 = 3000;
/// Time in ms on the ground after which a landing is complete.
pub const GROUND_MS: u16 = 1000;
/// Time in ms for which a robot that fell stands still before it can recover.
pub const CALM_MS: u16 = 1000;

/// Reason of an automatic landing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum LandingCause {
    OutsideFence,
    BatteryEmpty,
    ScriptFault,
    /// There was no set-point that the controller could follow.
    NoSetpoint,
}

/// Reason of a crash.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CrashCause {
    Tumble(TumbleSign),
    Impact,
    BlockedRotor,
    /// The motors pushed, and the robot did not move as it would in the air.
    NoEffect,
}

/// Reason why motors stay off until the next power-on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum LockReason {
    EmergencyStop,
    Imu(ImuFault),
    /// There was no set-point for 2 s, and no position.
    SetpointLost,
    /// The robot left its fence and has lost its position.
    OutsideFence,
    /// A descent did not reach the ground.
    DescentTimeout,
    /// A robot without a position did not reach the ground in time.
    LevelOutTimeout,
}

/// The end of a flight, from the moment at which the robot stops to follow set-points.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Descent {
    pub cause: LandingCause,
    /// Time since the descent began. It goes on while the robot loses and regains its position.
    pub waited: HoldTimer<DESCENT_TIMEOUT_MS>,
}

/// A state with its timers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SupervisorState {
    /// Disarmed; some checks fail.
    Preflight(FailedChecks),
    /// Disarmed; a person may arm the robot.
    Ready,
    /// The rotors start.
    Arming { idling: HoldTimer<200>, waited: HoldTimer<ARMING_TIMEOUT_MS>, tumble: TumbleMonitor },
    /// Armed on the ground.
    Armed { waited: HoldTimer<ARMED_TIMEOUT_MS>, tumble: TumbleMonitor },
    /// The controller follows set-points.
    Flying(FlightMonitor),
    /// The robot descends by itself.
    Landing { descent: Descent, ground: HoldTimer<GROUND_MS>, monitor: FlightMonitor },
    /// The robot has no position to land with and stays level.
    LevelOut {
        descent: Descent,
        waited: HoldTimer<LEVEL_OUT_TIMEOUT_MS>,
        /// The robot has not begun to land, and a set-point is all that it lacks.
        can_resume: bool,
        monitor: FlightMonitor,
    },
    /// On the ground after a flight.
    Landed { waited: HoldTimer<LANDED_TIMEOUT_MS> },
    /// Tipped over on the ground while armed.
    Tumbled { sign: TumbleSign, calm: HoldTimer<CALM_MS> },
    /// Crashed in flight.
    Crashed { cause: CrashCause, calm: HoldTimer<CALM_MS> },
    /// Off until the next power-on.
    Locked(LockReason),
}

/// A state without its data.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SupervisorStage {
    Preflight,
    Ready,
    Arming,
    Armed,
    Flying,
    Landing,
    LevelOut,
    Landed,
    Tumbled,
    Crashed,
    Locked,
}

impl SupervisorStage {
    /// All stages.
    pub const ALL: [SupervisorStage; 11] = [
        SupervisorStage::Preflight,
        SupervisorStage::Ready,
        SupervisorStage::Arming,
        SupervisorStage::Armed,
        SupervisorStage::Flying,
        SupervisorStage::Landing,
        SupervisorStage::LevelOut,
        SupervisorStage::Landed,
        SupervisorStage::Tumbled,
        SupervisorStage::Crashed,
        SupervisorStage::Locked,
    ];
}

impl SupervisorState {
    /// Returns the state without its data.
    pub fn stage(&self) -> SupervisorStage {
        match self {
            SupervisorState::Preflight(_) => SupervisorStage::Preflight,
            SupervisorState::Ready => SupervisorStage::Ready,
            SupervisorState::Arming { .. } => SupervisorStage::Arming,
            SupervisorState::Armed { .. } => SupervisorStage::Armed,
            SupervisorState::Flying(_) => SupervisorStage::Flying,
            SupervisorState::Landing { .. } => SupervisorStage::Landing,
            SupervisorState::LevelOut { .. } => SupervisorStage::LevelOut,
            SupervisorState::Landed { .. } => SupervisorStage::Landed,
            SupervisorState::Tumbled { .. } => SupervisorStage::Tumbled,
            SupervisorState::Crashed { .. } => SupervisorStage::Crashed,
            SupervisorState::Locked(_) => SupervisorStage::Locked,
        }
    }

    /// Returns what the state permits.
    pub(super) fn permission(&self, now: &Conditions) -> MotorPermission {
        match self {
            SupervisorState::Arming { .. } => MotorPermission::Idle,
            SupervisorState::Armed { .. } if now.setpoint == SetpointFreshness::Fresh => {
                MotorPermission::Follow
            }
            SupervisorState::Armed { .. } => MotorPermission::Idle,
            SupervisorState::Flying(_) => MotorPermission::Follow,
            SupervisorState::Landing { .. } => MotorPermission::Descend,
            SupervisorState::LevelOut { .. } => MotorPermission::Level,
            SupervisorState::Preflight(_)
            | SupervisorState::Ready
            | SupervisorState::Landed { .. }
            | SupervisorState::Tumbled { .. }
            | SupervisorState::Crashed { .. }
            | SupervisorState::Locked(_) => MotorPermission::Off,
        }
    }
}

/// The use that the flight controller may make of the motors.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MotorPermission {
    /// Motors are off.
    Off,
    /// Motors idle, without lift.
    Idle,
    /// The controller follows set-points.
    Follow,
    /// The controller keeps level, or brakes by the inertial sensors, and sinks.
    Level,
    /// The controller sinks at its position and ignores set-points.
    Descend,
}

impl MotorPermission {
    /// Returns true if motors may turn.
    pub fn allows_motors(self) -> bool {
        self != MotorPermission::Off
    }
}

/// The cause of a change between two states. The name of each is in the [table](super#transitions).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SupervisorEvent {
    EmergencyStop,
    ImuFault,
    DisarmRequest,
    ChecksPassed,
    CheckFailed,
    ArmRequest,
    UpsideDown,
    WeightUpwards,
    WeightSideways,
    ArmedCheckFailed,
    RotorsIdle,
    Lift,
    HardLanding,
    Impact,
    BlockedRotor,
    NoEffect,
    SetpointLost,
    OutsideFenceWithoutPosition,
    Ground,
    GroundWithoutLift,
    NoLift,
    OutsideFence,
    BatteryEmpty,
    ScriptFault,
    NoSetpoint,
    PositionLost,
    SetpointRenewed,
    ResumeRequest,
    PositionRegained,
    DescentTimeout,
    Timeout,
    Calm,
    RecoverRequest,
}

impl From<TumbleSign> for SupervisorEvent {
    fn from(sign: TumbleSign) -> Self {
        match sign {
            TumbleSign::UpsideDown => SupervisorEvent::UpsideDown,
            TumbleSign::WeightUpwards => SupervisorEvent::WeightUpwards,
            TumbleSign::WeightSideways => SupervisorEvent::WeightSideways,
        }
    }
}

/// A change between two states.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct SupervisorTransition {
    pub from: SupervisorStage,
    pub event: SupervisorEvent,
    pub to: SupervisorStage,
}

/// The result of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct SupervisorOutput {
    pub permission: MotorPermission,
    /// The change of state in this step, if there was one.
    pub transition: Option<SupervisorTransition>,
}
