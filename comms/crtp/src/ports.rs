//! All ports of a robot: bytes of a packet in, a command and an answer out.

use crate::high_level::{self, HighLevelAnswer, HighLevelCommand, HighLevelOutcome};
use crate::localization::{self, Localization};
use crate::log::{LogBlocks, LogVariable};
use crate::memory;
use crate::packet::{Packet, Port, RawPacket};
use crate::parameter::{Parameter, ParameterChange, Parameters};
use crate::platform::{self, Identity};
use crate::refusal::{Refusal, RefusalCounts};
use crate::setpoint::{self, Setpoint};
use crate::supervisor::{self, ArmingAnswer, ArmingRequest, SupervisorInfo};
use crate::trajectory::{Piece, StoredTrajectory, TrajectoryMemory};
use crate::value::Value;

/// Time in ms without a packet after which there is no ground station (radiolink.c).
pub const LINK_TIMEOUT_MS: u64 = 1000;

/// A command of a ground station, of which every number is finite and plausible.
#[derive(Clone, Debug, PartialEq)]
pub enum Command {
    Setpoint(Setpoint),
    /// No set-point follows for now; plans and the script may have the robot.
    SetpointsEnd,
    /// A flight to plan, and the answer that reports the outcome.
    HighLevel(HighLevelCommand, HighLevelAnswer),
    /// A person's request, and the answer that reports the outcome.
    Arming(ArmingRequest, ArmingAnswer),
    /// Motors off until the next power-on.
    EmergencyStop,
    /// A sign of life: once one was received, motors stop when no other follows within a second.
    EmergencyStopWatchdog,
    Localization(Localization),
    /// A parameter has a new value.
    Parameter(ParameterChange),
    /// The station asks the robot to show a person that something succeeded or failed.
    Notification {
        is_success: bool,
    },
}

/// The reaction to a packet.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Reaction {
    /// The command to be executed.
    pub command: Option<Command>,
    /// The answer to be sent.
    pub answer: Option<Packet>,
}

impl Reaction {
    fn command(command: Command) -> Self {
        Reaction { command: Some(command), answer: None }
    }

    fn answer(answer: Packet) -> Self {
        Reaction { command: None, answer: Some(answer) }
    }
}

/// A refusal, with an answer if the station waits for one.
type Refused = (Refusal, Option<Packet>);

/// The ports of a robot.
///
/// Only packets from the radio's CRTP address belong here: `RADIO_RAW` frames of the serial link.
/// Frames of other robots (P2P) have a type of their own there and reach no port.
#[derive(Clone, Debug)]
pub struct Ports {
    identity: Identity,
    parameters: Parameters,
    log: LogBlocks,
    trajectories: TrajectoryMemory,
    refusals: RefusalCounts,
    /// The time of the last packet.
    heard_ms: u64,
}

impl Ports {
    /// Returns the ports of a robot after power-on.
    pub fn new(identity: Identity) -> Self {
        Ports {
            identity,
            parameters: Parameters::default(),
            log: LogBlocks::default(),
            trajectories: TrajectoryMemory::new(),
            refusals: RefusalCounts::default(),
            heard_ms: 0,
        }
    }

    /// Handles a packet of a ground station.
    pub fn receive(&mut self, bytes: &[u8], now_ms: u64, info: &SupervisorInfo) -> Reaction {
        self.heard_ms = now_ms;
        let result = match RawPacket::new(bytes) {
            Some(packet) => self.react(&packet, now_ms, info),
            None => Err((Refusal::NoPacket, None)),
        };
        result.unwrap_or_else(|(refusal, answer)| {
            self.refusals.add(refusal);
            Reaction { command: None, answer }
        })
    }

    /// Returns the log packet that is due, if one is. Without a ground station there are no blocks.
    pub fn poll_log(
        &mut self,
        now_ms: u64,
        read: impl FnMut(LogVariable) -> Value,
    ) -> Option<Packet> {
        if now_ms.saturating_sub(self.heard_ms) > LINK_TIMEOUT_MS {
            self.log.reset();
        }
        self.log.poll(now_ms, read)
    }

    /// Returns the parameters.
    pub fn parameters(&self) -> &Parameters {
        &self.parameters
    }

    /// Returns the parameters, for the robot to change them.
    pub fn parameters_mut(&mut self) -> &mut Parameters {
        &mut self.parameters
    }

    /// Returns the counts of packets that were refused.
    pub fn refusals(&self) -> &RefusalCounts {
        &self.refusals
    }

    /// Returns a piece of a stored trajectory.
    ///
    /// # Errors
    /// Refuses a number beyond the last piece, and a piece that was overwritten with one that is
    /// not valid since the command to start.
    pub fn trajectory_piece(
        &self,
        trajectory: &StoredTrajectory,
        number: usize,
    ) -> Result<Piece, Refusal> {
        self.trajectories.piece(trajectory, number)
    }

    fn react(
        &mut self,
        packet: &RawPacket<'_>,
        now_ms: u64,
        info: &SupervisorInfo,
    ) -> Result<Reaction, Refused> {
        let (channel, data) = (packet.channel(), packet.data());
        let unanswered = |refusal| (refusal, None);
        match (packet.port(), channel) {
            (Some(Port::Setpoint), 0) => {
                let setpoint = setpoint::roll_pitch_yaw_thrust(data).map_err(unanswered)?;
                Ok(Reaction::command(Command::Setpoint(setpoint)))
            }
            (Some(Port::GenericSetpoint), 0) => {
                let setpoint = setpoint::generic(data).map_err(unanswered)?;
                Ok(Reaction::command(Command::Setpoint(setpoint)))
            }
            (Some(Port::GenericSetpoint), 1) => {
                setpoint::notify_stop(data).map_err(unanswered)?;
                Ok(Reaction::command(Command::SetpointsEnd))
            }
            (Some(Port::HighLevel), _) => {
                let answer = HighLevelAnswer::new(channel, data);
                self.high_level(data, answer).map_err(|refusal| {
                    let is_command = !data.is_empty();
                    (refusal, is_command.then(|| answer.packet(HighLevelOutcome::Refused)))
                })
            }
            (Some(Port::Supervisor), 0) => {
                supervisor::info(data, info).map(Reaction::answer).map_err(unanswered)
            }
            (Some(Port::Supervisor), 1) => {
                let request = supervisor::request(data).map_err(unanswered)?;
                Ok(Reaction::command(match request {
                    supervisor::Request::Arming(arming) => {
                        Command::Arming(arming, ArmingAnswer::new(false, arming))
                    }
                    supervisor::Request::EmergencyStop => Command::EmergencyStop,
                    supervisor::Request::EmergencyStopWatchdog => Command::EmergencyStopWatchdog,
                }))
            }
            (Some(Port::Platform), 0) => platform_command(data).map_err(unanswered),
            (Some(Port::Platform), 1) => {
                let answer = platform::version(data, &self.identity);
                answer.map(Reaction::answer).map_err(unanswered)
            }
            (Some(Port::Localization), _) => self.localization(channel, data).map_err(unanswered),
            (Some(Port::Link), _) => {
                Ok(Reaction { command: None, answer: platform::link(channel, data) })
            }
            (Some(Port::Log), _) => without_command(self.log.receive(packet, now_ms)),
            (Some(Port::Memory), _) => {
                without_command(memory::receive(packet, &mut self.trajectories))
            }
            (Some(Port::Parameter), _) => {
                let reaction = self.parameters.receive(packet, info.is_flying);
                let answer = reaction.answer;
                match reaction.change {
                    Ok(change) => Ok(Reaction { command: change.map(command_of), answer }),
                    Err(refusal) => Err((refusal, answer)),
                }
            }
            _ => Err(unanswered(Refusal::Unknown)),
        }
    }

    /// Handles the data of port 8. A command for groups that the robot is not in is answered and has
    /// no effect.
    fn high_level(&mut self, data: &[u8], answer: HighLevelAnswer) -> Result<Reaction, Refusal> {
        let done = || Reaction::answer(answer.packet(HighLevelOutcome::Done));
        let (groups, command) = match high_level::request(data)? {
            high_level::Request::SetGroups(groups) => {
                self.parameters.set(Parameter::HlCommanderGroupmask, groups.into());
                return Ok(done());
            }
            high_level::Request::Define { id, definition } => {
                self.trajectories.define(id, definition)?;
                return Ok(done());
            }
            high_level::Request::Fly { groups, command } => (groups, command),
            high_level::Request::Start { groups, id, start } => {
                (groups, start.command(self.trajectories.find(id)?))
            }
        };
        let own = self.parameters.get(Parameter::HlCommanderGroupmask);
        let is_member = match own {
            Value::Unsigned(own) => own & u32::from(groups) != 0,
            _ => false,
        };
        if groups == 0 || is_member {
            Ok(Reaction::command(Command::HighLevel(command, answer)))
        } else {
            Ok(done())
        }
    }

    fn localization(&self, channel: u8, data: &[u8]) -> Result<Reaction, Refusal> {
        let id = self.identity.id;
        let positions = |positions| Reaction::command(Command::Localization(positions));
        match channel {
            0 => localization::external_position(data).map(positions),
            1 => Ok(match localization::generic(data, id)? {
                localization::Request::Positions(found) => positions(found),
                localization::Request::EmergencyStop => Reaction::command(Command::EmergencyStop),
                localization::Request::EmergencyStopWatchdog => {
                    Reaction::command(Command::EmergencyStopWatchdog)
                }
                localization::Request::NoDeck { kind, rest } => {
                    let answer = Packet::new(Port::Localization, 1).with(&[kind]);
                    Reaction::answer(answer.with(rest.as_slice()).with(&[0]))
                }
            }),
            2 => localization::packed_positions(data, id).map(positions),
            _ => Err(Refusal::Unknown),
        }
    }
}

/// Parses the commands of port 13, channel 0.
fn platform_command(data: &[u8]) -> Result<Reaction, Refusal> {
    match *data {
        // During a continuous wave the robot would receive nothing.
        [0, ..] => Err(Refusal::Unsupported),
        [1 | 2, ..] => {
            let arming = supervisor::platform_request(data)?;
            let answer = ArmingAnswer::new(true, arming);
            Ok(Reaction::command(Command::Arming(arming, answer)))
        }
        [3, is_success] => Ok(Reaction {
            command: Some(Command::Notification { is_success: is_success != 0 }),
            answer: Some(Packet::new(Port::Platform, 0)),
        }),
        [3, ..] | [] => Err(Refusal::Length),
        _ => Err(Refusal::Unknown),
    }
}

/// Returns the command that a change of a parameter is.
fn command_of(change: ParameterChange) -> Command {
    match change {
        ParameterChange { parameter: Parameter::StabilizerStop, value: Value::Unsigned(1..) } => {
            Command::EmergencyStop
        }
        change => Command::Parameter(change),
    }
}

fn without_command(
    (result, answer): (Result<(), Refusal>, Option<Packet>),
) -> Result<Reaction, Refused> {
    match result {
        Ok(()) => Ok(Reaction { command: None, answer }),
        Err(refusal) => Err((refusal, answer)),
    }
}
