//! Positions from outside: port 6. Source: crtp_localization_service.c of crazyflie-firmware.

use heapless::Vec;

use crate::fields::Fields;
use crate::quaternion;
use crate::refusal::Refusal;

/// The types of channel 1.
mod kind {
    /// A packet for the Loco deck, which this robot does not have.
    pub const SHORT_LPP: u8 = 2;
    pub const EMERGENCY_STOP: u8 = 3;
    pub const EMERGENCY_STOP_WATCHDOG: u8 = 4;
    pub const EXTERNAL_POSE: u8 = 8;
    pub const EXTERNAL_POSE_PACKED: u8 = 9;
    /// A request of the Lighthouse deck, which this robot does not have.
    pub const LIGHTHOUSE_PERSIST: u8 = 11;
}

/// Positions in one packet at most: four packed ones of 7 bytes.
const POSITIONS_MAX: usize = 4;

/// The measured positions in a packet, in m in the world frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Localization {
    /// This robot's own.
    pub own: Option<MeasuredPose>,
    /// Those of others, by the lowest byte of their radio address.
    pub peers: Vec<PeerPosition, POSITIONS_MAX>,
}

/// A measured position, and the attitude if it was measured as well.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasuredPose {
    /// At most 1 km from the origin in each direction.
    pub position_m: [f32; 3],
    /// The rotation from the body frame to the world frame: x, y, z, w, of length 1 or nearly.
    pub quaternion: Option<[f32; 4]>,
}

/// The measured position of another robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PeerPosition {
    pub id: u8,
    pub position_m: [f32; 3],
}

/// A parsed packet of port 6.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Request {
    Positions(Localization),
    EmergencyStop,
    EmergencyStopWatchdog,
    /// A packet for a deck that the robot does not have, with the answer that says so.
    NoDeck {
        kind: u8,
        rest: Option<u8>,
    },
}

/// Parses the data of channel 0: one position.
pub(crate) fn external_position(data: &[u8]) -> Result<Localization, Refusal> {
    let mut fields = Fields::new(data);
    let position_m = fields.three(Fields::meters)?;
    fields.end()?;
    let own = Some(MeasuredPose { position_m, quaternion: None });
    Ok(Localization { own, peers: Vec::new() })
}

/// Parses the data of channel 1.
pub(crate) fn generic(data: &[u8], own_id: u8) -> Result<Request, Refusal> {
    let mut fields = Fields::new(data);
    match fields.byte()? {
        // Whatever follows: a station that wants the motors off gets them off.
        kind::EMERGENCY_STOP => Ok(Request::EmergencyStop),
        kind::EMERGENCY_STOP_WATCHDOG => Ok(Request::EmergencyStopWatchdog),
        kind::EXTERNAL_POSE => {
            let position_m = fields.three(Fields::meters)?;
            let quaternion = unit_quaternion(&mut fields)?;
            fields.end()?;
            let own = Some(MeasuredPose { position_m, quaternion: Some(quaternion) });
            Ok(Request::Positions(Localization { own, peers: Vec::new() }))
        }
        kind::EXTERNAL_POSE_PACKED => {
            let pose = |item: &[u8; 11]| {
                let mut fields = Fields::new(item);
                let (id, position_m) = packed_position(&mut fields)?;
                Ok((id, position_m, Some(quaternion::unpack(fields.u32()?)?)))
            };
            packed(fields.rest(), own_id, pose).map(Request::Positions)
        }
        kind @ kind::SHORT_LPP => {
            let rest = Some(fields.byte()?);
            Ok(Request::NoDeck { kind, rest })
        }
        kind @ kind::LIGHTHOUSE_PERSIST => Ok(Request::NoDeck { kind, rest: None }),
        _ => Err(Refusal::Unknown),
    }
}

/// Parses the data of channel 2: up to four packed positions.
pub(crate) fn packed_positions(data: &[u8], own_id: u8) -> Result<Localization, Refusal> {
    packed(data, own_id, |item: &[u8; 7]| {
        let (id, position_m) = packed_position(&mut Fields::new(item))?;
        Ok((id, position_m, None))
    })
}

type Item = (u8, [f32; 3], Option<[f32; 4]>);

/// Reads items of N bytes. One wrong item spoils the packet: its sender is out of order.
fn packed<const N: usize>(
    data: &[u8],
    own_id: u8,
    read: impl Fn(&[u8; N]) -> Result<Item, Refusal>,
) -> Result<Localization, Refusal> {
    let (items, []) = data.as_chunks::<N>() else { return Err(Refusal::Length) };
    if items.is_empty() {
        return Err(Refusal::Length);
    }
    let mut localization = Localization::default();
    for item in items {
        let (id, position_m, quaternion) = read(item)?;
        if id == own_id {
            localization.own = Some(MeasuredPose { position_m, quaternion });
        } else {
            let peer = PeerPosition { id, position_m };
            localization.peers.push(peer).map_err(|_| Refusal::Length)?;
        }
    }
    Ok(localization)
}

/// Reads an id and a position in mm.
fn packed_position(fields: &mut Fields<'_>) -> Result<(u8, [f32; 3]), Refusal> {
    Ok((fields.byte()?, fields.three(Fields::thousandths)?))
}

/// Reads a quaternion whose length differs from 1 by at most 5 %.
fn unit_quaternion(fields: &mut Fields<'_>) -> Result<[f32; 4], Refusal> {
    let [x, y, z] = fields.three(Fields::number)?;
    let quaternion = [x, y, z, fields.number()?];
    let square: f32 = quaternion.iter().map(|part| part * part).sum();
    if (0.9..=1.1).contains(&square) { Ok(quaternion) } else { Err(Refusal::NotUnit) }
}
