//! Memories: port 4. There is one, for trajectories. Source: crtp_mem.c of crazyflie-firmware.

use crate::fields::Fields;
use crate::packet::{Packet, Port, RawPacket};
use crate::refusal::Refusal;
use crate::trajectory::{TRAJECTORY_BYTES, TrajectoryMemory};

/// The channels.
const INFO: u8 = 0;
const READ: u8 = 1;
const WRITE: u8 = 2;

/// The commands of channel 0.
const GET_COUNT: u8 = 1;
const GET_INFO: u8 = 2;

/// The memory for trajectories, and its type (mem.h).
const TRAJECTORIES: u8 = 0;
const TRAJECTORY_TYPE: u8 = 0x12;
/// Bytes of a serial number, which this memory does not have; clients expect at least 8 of them.
const SERIAL: [u8; 8] = [0; 8];

const OK: u8 = 0;
/// `EIO` of newlib.
const INPUT_OUTPUT_ERROR: u8 = 5;

/// Handles a packet of port 4. A refusal counts and may have an answer all the same.
pub(crate) fn receive(
    packet: &RawPacket<'_>,
    trajectories: &mut TrajectoryMemory,
) -> (Result<(), Refusal>, Option<Packet>) {
    let result = match packet.channel() {
        INFO => info(packet.data()).map(|answer| (Ok(()), answer)),
        READ => read(packet.data(), trajectories),
        WRITE => write(packet.data(), trajectories),
        _ => Err(Refusal::Unknown),
    };
    match result {
        Ok((result, answer)) => (result, Some(answer)),
        Err(refusal) => (Err(refusal), None),
    }
}

fn info(data: &[u8]) -> Result<Packet, Refusal> {
    let answer = Packet::new(Port::Memory, INFO);
    match *data {
        [GET_COUNT] => Ok(answer.with(&[GET_COUNT, 1])),
        [GET_INFO, TRAJECTORIES] => {
            let answer = answer.with(&[GET_INFO, TRAJECTORIES, TRAJECTORY_TYPE]);
            Ok(answer.with(&(TRAJECTORY_BYTES as u32).to_le_bytes()).with(&SERIAL))
        }
        // An answer without type says that there is no such memory.
        [GET_INFO, id] => Ok(answer.with(&[GET_INFO, id])),
        [] | [GET_COUNT | GET_INFO, ..] => Err(Refusal::Length),
        _ => Err(Refusal::Unknown),
    }
}

type Answered = (Result<(), Refusal>, Packet);

fn read(data: &[u8], trajectories: &TrajectoryMemory) -> Result<Answered, Refusal> {
    let mut fields = Fields::new(data);
    let (id, address, length) = (fields.byte()?, fields.u32()?, fields.byte()?);
    fields.end()?;
    let answer = Packet::new(Port::Memory, READ).with(&[id]).with(&address.to_le_bytes());
    let bytes = match id {
        TRAJECTORIES => trajectories.read(address, length.into()),
        _ => Err(Refusal::Address),
    };
    // A byte of room is for the status.
    let bytes =
        bytes.and_then(
            |bytes| {
                if bytes.len() < answer.room() { Ok(bytes) } else { Err(Refusal::Length) }
            },
        );
    Ok(match bytes {
        Ok(bytes) => (Ok(()), answer.with(&[OK]).with(bytes)),
        Err(refusal) => (Err(refusal), answer.with(&[INPUT_OUTPUT_ERROR])),
    })
}

fn write(data: &[u8], trajectories: &mut TrajectoryMemory) -> Result<Answered, Refusal> {
    let mut fields = Fields::new(data);
    let (id, address) = (fields.byte()?, fields.u32()?);
    let result = match id {
        TRAJECTORIES => trajectories.write(address, fields.rest()),
        _ => Err(Refusal::Address),
    };
    let status = if result.is_ok() { OK } else { INPUT_OUTPUT_ERROR };
    let answer = Packet::new(Port::Memory, WRITE).with(&[id]).with(&address.to_le_bytes());
    Ok((result, answer.with(&[status])))
}
