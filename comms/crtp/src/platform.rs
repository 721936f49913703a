//! The link and the platform: echo, versions, names. Sources: crtpservice.c and platformservice.c of
//! crazyflie-firmware.

use crate::packet::{Packet, Port};
use crate::refusal::Refusal;

/// The version of the protocol: since 12 the supervisor has a port of its own (crtp.h).
const PROTOCOL_VERSION: u32 = 12;
/// The text by which clients recognize a robot that reports its protocol version.
const SOURCE: &[u8] = b"Bitcraze Crazyflie";

/// The channels of the link.
mod link {
    pub const ECHO: u8 = 0;
    pub const SOURCE: u8 = 1;
    pub const SINK: u8 = 2;
    pub const NULL: u8 = 3;
}

/// The requests for versions.
const GET_PROTOCOL: u8 = 0;
const GET_FIRMWARE: u8 = 1;
const GET_DEVICE: u8 = 2;

/// Names that the robot reports to ground stations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Identity {
    /// The lowest byte of the radio address, by which packed positions name robots.
    pub id: u8,
    /// The firmware's name and version, of which 29 bytes are sent.
    pub firmware: &'static str,
    /// The type of the robot, such as "CF21", of which 29 bytes are sent.
    pub device: &'static str,
}

/// Answers a packet of the link's port, if it wants an answer.
pub(crate) fn link(channel: u8, data: &[u8]) -> Option<Packet> {
    match channel {
        link::ECHO => Some(Packet::new(Port::Link, link::ECHO).with(data)),
        link::SOURCE => {
            let rest = [0; 30 - SOURCE.len()];
            Some(Packet::new(Port::Link, link::SOURCE).with(SOURCE).with(&rest))
        }
        link::SINK | link::NULL => None,
        _ => None,
    }
}

/// Answers a request for a version or a name: port 13, channel 1.
pub(crate) fn version(data: &[u8], identity: &Identity) -> Result<Packet, Refusal> {
    let answer = |request: u8| Packet::new(Port::Platform, 1).with(&[request]);
    match data.first() {
        Some(&GET_PROTOCOL) => Ok(answer(GET_PROTOCOL).with(&PROTOCOL_VERSION.to_le_bytes())),
        Some(&GET_FIRMWARE) => Ok(answer(GET_FIRMWARE).with(identity.firmware.as_bytes())),
        Some(&GET_DEVICE) => Ok(answer(GET_DEVICE).with(identity.device.as_bytes())),
        Some(_) => Err(Refusal::Unknown),
        None => Err(Refusal::Length),
    }
}
