//! High-level commands: port 8. The robot plans the flight itself, so one packet is enough for
//! each. Source: crtp_commander_high_level.c of crazyflie-firmware.

use crate::fields::Fields;
use crate::packet::{Packet, Port};
use crate::refusal::Refusal;
use crate::trajectory::{Definition, StoredTrajectory};

/// The commands of port 8.
mod command {
    pub const SET_GROUP_MASK: u8 = 0;
    pub const TAKE_OFF: u8 = 1;
    pub const LAND: u8 = 2;
    pub const STOP: u8 = 3;
    pub const GO_TO: u8 = 4;
    pub const START_TRAJECTORY: u8 = 5;
    pub const DEFINE_TRAJECTORY: u8 = 6;
    pub const TAKE_OFF_2: u8 = 7;
    pub const LAND_2: u8 = 8;
    pub const TAKE_OFF_WITH_VELOCITY: u8 = 9;
    pub const LAND_WITH_VELOCITY: u8 = 10;
    pub const SPIRAL: u8 = 11;
    pub const GO_TO_2: u8 = 12;
    pub const START_TRAJECTORY_2: u8 = 13;
}

/// A command to plan a flight. Angles are in radians and right-handed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum HighLevelCommand {
    TakeOff(VerticalFlight),
    Land(VerticalFlight),
    /// Motors off, in flight too.
    Stop,
    GoTo {
        position_m: [f32; 3],
        yaw_rad: f32,
        duration_s: f32,
        /// Position and yaw count from those of the present reference.
        is_relative: bool,
        /// The robot flies at constant speed, without a smooth start and end.
        is_linear: bool,
    },
    /// An arc whose radius changes; of at most two turns, with radii that are not negative.
    Spiral {
        angle_rad: f32,
        first_radius_m: f32,
        last_radius_m: f32,
        climb_m: f32,
        duration_s: f32,
        is_sideways: bool,
        is_clockwise: bool,
    },
    StartTrajectory {
        trajectory: StoredTrajectory,
        /// The factor of all durations: more than 1 is slower.
        time_scale: f32,
        is_position_relative: bool,
        is_yaw_relative: bool,
        is_reversed: bool,
    },
}

/// A flight straight up or down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VerticalFlight {
    pub height: Height,
    /// The yaw at the end; `None` keeps the present one.
    pub yaw_rad: Option<f32>,
    pub pace: Pace,
}

/// The height at the end of a vertical flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Height {
    /// z in the world frame, in m.
    Absolute(f32),
    /// The height in m above the present one.
    Above(f32),
}

/// The speed of a vertical flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pace {
    DurationS(f32),
    /// The mean speed in m/s, more than 0.
    SpeedMS(f32),
    /// The robot's own speed: parameters `hlCommander.vtoff` and `vland`.
    Default,
}

/// A parsed packet of port 8.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Request {
    SetGroups(u8),
    Define { id: u8, definition: Definition },
    Fly { groups: u8, command: HighLevelCommand },
    Start { groups: u8, id: u8, start: Start },
}

/// A start of a trajectory that was not looked up yet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Start {
    time_scale: f32,
    is_position_relative: bool,
    is_yaw_relative: bool,
    is_reversed: bool,
}

impl Start {
    /// Returns the command to follow this trajectory.
    pub fn command(&self, trajectory: StoredTrajectory) -> HighLevelCommand {
        let Start { time_scale, is_position_relative, is_yaw_relative, is_reversed } = *self;
        HighLevelCommand::StartTrajectory {
            trajectory,
            time_scale,
            is_position_relative,
            is_yaw_relative,
            is_reversed,
        }
    }
}

/// Parses the data of port 8.
pub(crate) fn request(data: &[u8]) -> Result<Request, Refusal> {
    let mut fields = Fields::new(data);
    let command = fields.byte()?;
    let first = fields.byte()?;
    let fly = |command| Request::Fly { groups: first, command };
    let request = match command {
        command::SET_GROUP_MASK => Request::SetGroups(first),
        // Whatever follows: a station that wants the motors off gets them off.
        command::STOP => return Ok(fly(HighLevelCommand::Stop)),
        command::TAKE_OFF => fly(HighLevelCommand::TakeOff(by_old_command(&mut fields)?)),
        command::LAND => fly(HighLevelCommand::Land(by_old_command(&mut fields)?)),
        command::TAKE_OFF_2 => fly(HighLevelCommand::TakeOff(by_duration(&mut fields)?)),
        command::LAND_2 => fly(HighLevelCommand::Land(by_duration(&mut fields)?)),
        command::TAKE_OFF_WITH_VELOCITY => {
            fly(HighLevelCommand::TakeOff(by_speed(&mut fields, 1.0)?))
        }
        // The relative height of a landing points downwards.
        command::LAND_WITH_VELOCITY => fly(HighLevelCommand::Land(by_speed(&mut fields, -1.0)?)),
        command::GO_TO => {
            let is_relative = fields.flag()?;
            fly(go_to(&mut fields, is_relative, false)?)
        }
        command::GO_TO_2 => {
            let (is_relative, is_linear) = (fields.flag()?, fields.flag()?);
            fly(go_to(&mut fields, is_relative, is_linear)?)
        }
        command::SPIRAL => fly(spiral(&mut fields)?),
        command::DEFINE_TRAJECTORY => {
            Request::Define { id: first, definition: Definition::parse(&mut fields)? }
        }
        command::START_TRAJECTORY => {
            let (is_position_relative, is_reversed) = (fields.flag()?, fields.flag()?);
            let id = fields.byte()?;
            let time_scale = time_scale(&mut fields)?;
            let is_yaw_relative = false;
            let start = Start { time_scale, is_position_relative, is_yaw_relative, is_reversed };
            Request::Start { groups: first, id, start }
        }
        command::START_TRAJECTORY_2 => {
            let (is_position_relative, is_yaw_relative) = (fields.flag()?, fields.flag()?);
            let is_reversed = fields.flag()?;
            let id = fields.byte()?;
            let time_scale = time_scale(&mut fields)?;
            let start = Start { time_scale, is_position_relative, is_yaw_relative, is_reversed };
            Request::Start { groups: first, id, start }
        }
        _ => return Err(Refusal::Unknown),
    };
    fields.end()?;
    Ok(request)
}

/// Reads height and duration. These old commands turn the robot to yaw 0.
fn by_old_command(fields: &mut Fields<'_>) -> Result<VerticalFlight, Refusal> {
    let height = Height::Absolute(fields.meters()?);
    let pace = Pace::DurationS(fields.seconds()?);
    Ok(VerticalFlight { height, yaw_rad: Some(0.0), pace })
}

fn by_duration(fields: &mut Fields<'_>) -> Result<VerticalFlight, Refusal> {
    let height = Height::Absolute(fields.meters()?);
    let yaw_rad = yaw(fields)?;
    Ok(VerticalFlight { height, yaw_rad, pace: Pace::DurationS(fields.seconds()?) })
}

fn by_speed(fields: &mut Fields<'_>, relative_sign: f32) -> Result<VerticalFlight, Refusal> {
    let height_m = fields.meters()?;
    let height = if fields.flag()? {
        Height::Above(relative_sign * height_m)
    } else {
        Height::Absolute(height_m)
    };
    let yaw_rad = yaw(fields)?;
    let speed_m_s = fields.meters_per_second()?;
    let pace = if speed_m_s > 0.0 { Pace::SpeedMS(speed_m_s) } else { Pace::Default };
    Ok(VerticalFlight { height, yaw_rad, pace })
}

/// Reads a yaw and the flag that the present one is meant instead.
fn yaw(fields: &mut Fields<'_>) -> Result<Option<f32>, Refusal> {
    let yaw_rad = fields.radians()?;
    Ok(if fields.flag()? { None } else { Some(yaw_rad) })
}

fn go_to(
    fields: &mut Fields<'_>,
    is_relative: bool,
    is_linear: bool,
) -> Result<HighLevelCommand, Refusal> {
    let position_m = fields.three(Fields::meters)?;
    let (yaw_rad, duration_s) = (fields.radians()?, fields.seconds()?);
    Ok(HighLevelCommand::GoTo { position_m, yaw_rad, duration_s, is_relative, is_linear })
}

fn spiral(fields: &mut Fields<'_>) -> Result<HighLevelCommand, Refusal> {
    let (is_sideways, is_clockwise) = (fields.flag()?, fields.flag()?);
    let angle_rad = fields.radians()?;
    let (first_radius_m, last_radius_m) = (fields.meters()?, fields.meters()?);
    let (climb_m, duration_s) = (fields.meters()?, fields.seconds()?);
    if first_radius_m < 0.0 || last_radius_m < 0.0 {
        return Err(Refusal::OutOfRange);
    }
    Ok(HighLevelCommand::Spiral {
        angle_rad,
        first_radius_m,
        last_radius_m,
        climb_m,
        duration_s,
        is_sideways,
        is_clockwise,
    })
}

/// Reads a factor of durations. A hundredth and a hundredfold are beyond any flight.
fn time_scale(fields: &mut Fields<'_>) -> Result<f32, Refusal> {
    let factor = fields.number()?;
    if (0.01..=100.0).contains(&factor) { Ok(factor) } else { Err(Refusal::OutOfRange) }
}

/// The result of a high-level command, which its answer reports.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HighLevelOutcome {
    Done,
    /// The supervisor or another source of commands is in charge.
    Busy,
    /// The robot cannot do that: the planner refused it.
    Refused,
}

/// The answer to a high-level command, which lacks only the outcome.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HighLevelAnswer {
    channel: u8,
    /// The first bytes of the command.
    start: [u8; 3],
}

impl HighLevelAnswer {
    pub(crate) fn new(channel: u8, data: &[u8]) -> Self {
        let mut start = [0; 3];
        start.iter_mut().zip(data).for_each(|(slot, byte)| *slot = *byte);
        HighLevelAnswer { channel, start }
    }

    /// Returns the answer with this outcome. Its numbers are the errno of newlib.
    pub fn packet(&self, outcome: HighLevelOutcome) -> Packet {
        let errno = match outcome {
            HighLevelOutcome::Done => 0,
            HighLevelOutcome::Busy => 16,
            HighLevelOutcome::Refused => 8,
        };
        Packet::new(Port::HighLevel, self.channel).with(&self.start).with(&[errno])
    }
}
