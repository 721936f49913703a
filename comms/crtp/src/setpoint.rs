//! Set-points: ports 3 and 7. They hold until the next one, for at most half a second.
//!
//! Bitcraze's pitch is positive with the nose up (stabilizer.c: "legacy CF2 body coordinate system,
//! where pitch is inverted"), and the rate of yaw is inverted in port 3 and in the older types of
//! port 7. Here all angles are right-handed about x ahead, y to the left and z upwards, so a
//! positive pitch lowers the nose. Sources: crtp_commander_rpyt.c, crtp_commander_generic.c.

use crate::fields::Fields;
use crate::quaternion;
use crate::refusal::Refusal;

/// The types of port 7, channel 0.
mod kind {
    pub const STOP: u8 = 0;
    pub const VELOCITY_WORLD_LEGACY: u8 = 1;
    pub const Z_DISTANCE_LEGACY: u8 = 2;
    pub const CPPM: u8 = 3;
    pub const ALTITUDE_HOLD: u8 = 4;
    pub const HOVER_LEGACY: u8 = 5;
    pub const FULL_STATE: u8 = 6;
    pub const POSITION: u8 = 7;
    pub const VELOCITY_WORLD: u8 = 8;
    pub const Z_DISTANCE: u8 = 9;
    pub const HOVER: u8 = 10;
    pub const MANUAL: u8 = 11;
}

/// The meta command of port 7, channel 1: set-points end.
const NOTIFY_STOP: u8 = 0;

/// A set-point. Angles are in radians and right-handed; the body frame has x ahead, y to the left
/// and z upwards, the world frame z upwards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Setpoint {
    /// Motors off, in flight too.
    Stop,
    Thrust(ThrustSetpoint),
    /// A velocity in the world frame.
    Velocity {
        velocity_m_s: [f32; 3],
        yaw_rate_rad_s: f32,
    },
    /// An attitude, at a height or with a vertical speed.
    Attitude {
        roll_rad: f32,
        pitch_rad: f32,
        yaw_rate_rad_s: f32,
        vertical: Vertical,
    },
    /// A horizontal velocity in the body frame, at a height in the world.
    Hover {
        ahead_m_s: f32,
        left_m_s: f32,
        yaw_rate_rad_s: f32,
        height_m: f32,
    },
    /// Position, velocity, acceleration, attitude and rates of a path.
    FullState(FullState),
    Position {
        position_m: [f32; 3],
        yaw_rad: f32,
    },
}

/// Roll, pitch and thrust, as a person with sticks commands them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThrustSetpoint {
    pub tilt: Tilt,
    pub yaw_rate_rad_s: f32,
    /// The thrust of all motors: 0 is off, and 65,535 is the most.
    pub thrust: u16,
}

/// Roll and pitch, or their rates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Tilt {
    Angle { roll_rad: f32, pitch_rad: f32 },
    Rate { roll_rad_s: f32, pitch_rad_s: f32 },
}

/// The vertical part of a set-point, in the world frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Vertical {
    HeightM(f32),
    SpeedMS(f32),
}

/// A moment of a path, in the world frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FullState {
    pub position_m: [f32; 3],
    pub velocity_m_s: [f32; 3],
    pub acceleration_m_s2: [f32; 3],
    /// The rotation from the body frame to the world frame: x, y, z, w, of length 1.
    pub quaternion: [f32; 4],
    /// Rates about the axes of the body.
    pub rates_rad_s: [f32; 3],
}

/// Parses the data of port 3: roll, pitch and rate of yaw in degrees, and thrust.
pub(crate) fn roll_pitch_yaw_thrust(data: &[u8]) -> Result<Setpoint, Refusal> {
    let mut fields = Fields::new(data);
    let (roll_rad, pitch_rad) = (fields.degrees()?, -fields.degrees()?);
    let yaw_rate_rad_s = -fields.degrees_per_second()?;
    let thrust = fields.u16()?;
    fields.end()?;
    let tilt = Tilt::Angle { roll_rad, pitch_rad };
    Ok(Setpoint::Thrust(ThrustSetpoint { tilt, yaw_rate_rad_s, thrust }))
}

/// Parses the data of port 7, channel 0.
pub(crate) fn generic(data: &[u8]) -> Result<Setpoint, Refusal> {
    let mut fields = Fields::new(data);
    let setpoint = match fields.byte()? {
        // Whatever follows: a station that wants the motors off gets them off.
        kind::STOP => return Ok(Setpoint::Stop),
        kind::VELOCITY_WORLD => velocity(&mut fields, 1.0)?,
        kind::VELOCITY_WORLD_LEGACY => velocity(&mut fields, -1.0)?,
        kind::Z_DISTANCE => z_distance(&mut fields, 1.0)?,
        kind::Z_DISTANCE_LEGACY => z_distance(&mut fields, -1.0)?,
        kind::HOVER => hover(&mut fields, 1.0)?,
        kind::HOVER_LEGACY => hover(&mut fields, -1.0)?,
        kind::ALTITUDE_HOLD => {
            let (roll_rad, pitch_rad) = (fields.degrees()?, -fields.degrees()?);
            let yaw_rate_rad_s = fields.degrees_per_second()?;
            let vertical = Vertical::SpeedMS(fields.meters_per_second()?);
            Setpoint::Attitude { roll_rad, pitch_rad, yaw_rate_rad_s, vertical }
        }
        kind::FULL_STATE => Setpoint::FullState(full_state(&mut fields)?),
        kind::POSITION => Setpoint::Position {
            position_m: fields.three(Fields::meters)?,
            yaw_rad: fields.degrees()?,
        },
        kind::MANUAL => Setpoint::Thrust(manual(&mut fields)?),
        // Channels of a remote control, of which each kind of transmitter has its own range.
        kind::CPPM => return Err(Refusal::Unsupported),
        _ => return Err(Refusal::Unknown),
    };
    fields.end()?;
    Ok(setpoint)
}

/// Parses the data of port 7, channel 1: the notice that set-points end. Its milliseconds have no
/// use (crtp_commander.c: "an artifact").
pub(crate) fn notify_stop(data: &[u8]) -> Result<(), Refusal> {
    let mut fields = Fields::new(data);
    if fields.byte()? != NOTIFY_STOP {
        return Err(Refusal::Unknown);
    }
    fields.u32()?;
    fields.end()
}

fn velocity(fields: &mut Fields<'_>, yaw_sign: f32) -> Result<Setpoint, Refusal> {
    let velocity_m_s = fields.three(Fields::meters_per_second)?;
    let yaw_rate_rad_s = yaw_sign * fields.degrees_per_second()?;
    Ok(Setpoint::Velocity { velocity_m_s, yaw_rate_rad_s })
}

fn z_distance(fields: &mut Fields<'_>, yaw_sign: f32) -> Result<Setpoint, Refusal> {
    let (roll_rad, pitch_rad) = (fields.degrees()?, -fields.degrees()?);
    let yaw_rate_rad_s = yaw_sign * fields.degrees_per_second()?;
    let vertical = Vertical::HeightM(fields.meters()?);
    Ok(Setpoint::Attitude { roll_rad, pitch_rad, yaw_rate_rad_s, vertical })
}

fn hover(fields: &mut Fields<'_>, yaw_sign: f32) -> Result<Setpoint, Refusal> {
    let (ahead_m_s, left_m_s) = (fields.meters_per_second()?, fields.meters_per_second()?);
    let yaw_rate_rad_s = yaw_sign * fields.degrees_per_second()?;
    Ok(Setpoint::Hover { ahead_m_s, left_m_s, yaw_rate_rad_s, height_m: fields.meters()? })
}

/// Reads thousandths of m, m/s, m/s² and rad/s, each in 16 bits. The rates of pitch are
/// right-handed here already: controller_mellinger.c compares them with the gyroscope's y.
fn full_state(fields: &mut Fields<'_>) -> Result<FullState, Refusal> {
    Ok(FullState {
        position_m: fields.three(Fields::thousandths)?,
        velocity_m_s: fields.three(Fields::thousandths)?,
        acceleration_m_s2: fields.three(Fields::thousandths)?,
        quaternion: quaternion::unpack(fields.u32()?)?,
        rates_rad_s: fields.three(Fields::thousandths)?,
    })
}

fn manual(fields: &mut Fields<'_>) -> Result<ThrustSetpoint, Refusal> {
    let (roll, pitch) = (fields.degrees()?, -fields.degrees()?);
    let yaw_rate_rad_s = fields.degrees_per_second()?;
    let thrust = fields.u16()?;
    let tilt = if fields.flag()? {
        Tilt::Rate { roll_rad_s: roll, pitch_rad_s: pitch }
    } else {
        Tilt::Angle { roll_rad: roll, pitch_rad: pitch }
    };
    Ok(ThrustSetpoint { tilt, yaw_rate_rad_s, thrust })
}
