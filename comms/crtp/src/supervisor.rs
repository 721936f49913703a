//! Requests to arm, to recover and to stop, and the supervisor's state: port 9, and port 13 from
//! before protocol version 12. Sources: crtp_supervisor.h, crtp_supervisor.c, platformservice.c and
//! supervisor.c of crazyflie-firmware.

use crate::fields::Fields;
use crate::packet::{Packet, Port};
use crate::refusal::Refusal;

/// The commands of port 9, channel 1.
mod command {
    pub const ARM: u8 = 1;
    pub const RECOVER: u8 = 2;
    pub const EMERGENCY_STOP: u8 = 3;
    pub const EMERGENCY_STOP_WATCHDOG: u8 = 4;
}

/// The request of port 9, channel 0 for all bits; those before it ask for one bit each.
const ALL_BITS: u8 = 12;
/// The bit of an answer's command.
const RESPONSE: u8 = 0x80;

/// The supervisor's state, as ground stations show it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SupervisorInfo {
    pub can_be_armed: bool,
    pub is_armed: bool,
    /// The robot arms by itself.
    pub is_auto_armed: bool,
    pub can_fly: bool,
    pub is_flying: bool,
    pub is_tumbled: bool,
    /// The motors stay off until the next power-on.
    pub is_locked: bool,
    pub is_crashed: bool,
    /// A planned flight is in command.
    pub is_plan_active: bool,
    pub is_plan_finished: bool,
    /// The planner gives no set-points.
    pub is_plan_disabled: bool,
    pub has_deck_fault: bool,
}

impl SupervisorInfo {
    /// Returns the bits as in the log variable `supervisor.info`.
    pub fn bits(&self) -> u16 {
        let bits = [
            self.can_be_armed,
            self.is_armed,
            self.is_auto_armed,
            self.can_fly,
            self.is_flying,
            self.is_tumbled,
            self.is_locked,
            self.is_crashed,
            self.is_plan_active,
            self.is_plan_finished,
            self.is_plan_disabled,
            self.has_deck_fault,
        ];
        bits.iter().rev().fold(0, |bits, bit| bits << 1 | u16::from(*bit))
    }
}

/// A request of a person at a ground station.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ArmingRequest {
    Arm,
    Disarm,
    /// The robot that crashed is whole.
    Recover,
}

/// A parsed packet for the supervisor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Request {
    Arming(ArmingRequest),
    EmergencyStop,
    EmergencyStopWatchdog,
}

/// Answers the data of port 9, channel 0.
pub(crate) fn info(data: &[u8], info: &SupervisorInfo) -> Result<Packet, Refusal> {
    let mut fields = Fields::new(data);
    let request = fields.byte()?;
    fields.end()?;
    let answer = Packet::new(Port::Supervisor, 0).with(&[RESPONSE | request]);
    match request {
        1..ALL_BITS => Ok(answer.with(&[(info.bits() >> (request - 1) & 1) as u8])),
        ALL_BITS => Ok(answer.with(&info.bits().to_le_bytes())),
        _ => Err(Refusal::Unknown),
    }
}

/// Parses the data of port 9, channel 1.
pub(crate) fn request(data: &[u8]) -> Result<Request, Refusal> {
    let mut fields = Fields::new(data);
    match fields.byte()? {
        command::ARM => arm(fields),
        command::RECOVER => Ok(Request::Arming(ArmingRequest::Recover)),
        // Whatever follows: a station that wants the motors off gets them off.
        command::EMERGENCY_STOP => Ok(Request::EmergencyStop),
        command::EMERGENCY_STOP_WATCHDOG => Ok(Request::EmergencyStopWatchdog),
        _ => Err(Refusal::Unknown),
    }
}

/// Parses the two commands of port 13, channel 0 that have the numbers of port 9.
pub(crate) fn platform_request(data: &[u8]) -> Result<ArmingRequest, Refusal> {
    match request(data)? {
        Request::Arming(arming) => Ok(arming),
        _ => Err(Refusal::Unknown),
    }
}

fn arm(mut fields: Fields<'_>) -> Result<Request, Refusal> {
    let arming = if fields.flag()? { ArmingRequest::Arm } else { ArmingRequest::Disarm };
    fields.end()?;
    Ok(Request::Arming(arming))
}

/// The answer to a request to arm, disarm or recover, which lacks only the outcome.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ArmingAnswer {
    /// The answer goes to port 13 instead of port 9.
    is_platform: bool,
    request: ArmingRequest,
}

impl ArmingAnswer {
    pub(crate) fn new(is_platform: bool, request: ArmingRequest) -> Self {
        ArmingAnswer { is_platform, request }
    }

    /// Returns the answer: the request was accepted or not, and the robot is in this state now.
    pub fn packet(&self, is_accepted: bool, info: &SupervisorInfo) -> Packet {
        let (command, state) = match self.request {
            ArmingRequest::Arm | ArmingRequest::Disarm => (command::ARM, info.is_armed),
            ArmingRequest::Recover => (command::RECOVER, !info.is_crashed),
        };
        let packet = if self.is_platform {
            Packet::new(Port::Platform, 0).with(&[command])
        } else {
            Packet::new(Port::Supervisor, 1).with(&[RESPONSE | command])
        };
        packet.with(&[u8::from(is_accepted), u8::from(state)])
    }
}
