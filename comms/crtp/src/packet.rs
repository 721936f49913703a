//! Packets: a header with port and channel, and up to 30 bytes of data.

use heapless::Vec;

/// Bytes of the longest packet, with its header.
pub const PACKET_MAX: usize = 1 + DATA_MAX;
/// Bytes of data in the longest packet.
pub const DATA_MAX: usize = 30;

/// A port: the service of the robot that a packet is for (crtp.h of crazyflie-firmware).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Port {
    /// Text of the robot.
    Console = 0,
    Parameter = 2,
    /// Roll, pitch, rate of yaw and thrust.
    Setpoint = 3,
    Memory = 4,
    Log = 5,
    Localization = 6,
    GenericSetpoint = 7,
    HighLevel = 8,
    Supervisor = 9,
    Platform = 13,
    Link = 15,
}

impl Port {
    const ALL: [Port; 11] = [
        Port::Console,
        Port::Parameter,
        Port::Setpoint,
        Port::Memory,
        Port::Log,
        Port::Localization,
        Port::GenericSetpoint,
        Port::HighLevel,
        Port::Supervisor,
        Port::Platform,
        Port::Link,
    ];
}

/// A packet of a ground station of which nothing but the length was checked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RawPacket<'a> {
    port: u8,
    channel: u8,
    data: &'a [u8],
}

impl<'a> RawPacket<'a> {
    /// Returns the packet in these bytes: a header and at most 30 bytes of data. The two bits
    /// between port and channel belong to the link and may be anything.
    pub fn new(bytes: &'a [u8]) -> Option<Self> {
        let (header, data) = bytes.split_first()?;
        let fits = data.len() <= DATA_MAX;
        fits.then_some(RawPacket { port: header >> 4, channel: header & 3, data })
    }

    /// Returns the port, if the robot has it.
    pub fn port(&self) -> Option<Port> {
        Port::ALL.into_iter().find(|port| *port as u8 == self.port)
    }

    /// Returns the channel, 0 to 3.
    pub fn channel(&self) -> u8 {
        self.channel
    }

    /// Returns the data.
    pub fn data(&self) -> &'a [u8] {
        self.data
    }
}

/// A packet to a ground station.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Packet {
    bytes: Vec<u8, PACKET_MAX>,
}

impl Packet {
    /// Returns a packet without data. A channel beyond 3 does not exist and becomes one of those.
    pub(crate) fn new(port: Port, channel: u8) -> Self {
        let mut packet = Packet { bytes: Vec::new() };
        packet.push((port as u8) << 4 | channel & 3);
        packet
    }

    /// Returns this packet with more data. Data beyond the longest packet would be cut off; no
    /// caller has that much.
    pub(crate) fn with(mut self, data: &[u8]) -> Self {
        data.iter().for_each(|byte| self.push(*byte));
        self
    }

    fn push(&mut self, byte: u8) {
        let _ = self.bytes.push(byte);
    }

    /// Returns the bytes as the radio sends them: the header and the data.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Returns the number of bytes of data that still fit.
    pub(crate) fn room(&self) -> usize {
        PACKET_MAX - self.bytes.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_header_has_port_and_channel() {
        for reserved in [0, 0x04, 0x0c] {
            let bytes = [0x52 | reserved, 7];
            let packet = RawPacket::new(&bytes).unwrap();
            assert_eq!((packet.port(), packet.channel()), (Some(Port::Log), 2));
            assert_eq!(packet.data(), [7]);
        }
        assert_eq!(RawPacket::new(&[0x10]).unwrap().port(), None);
        assert_eq!(Packet::new(Port::Log, 2).with(&[7]).bytes(), [0x52, 7]);
    }

    #[test]
    fn a_packet_has_1_to_31_bytes() {
        assert_eq!(RawPacket::new(&[]), None);
        assert!(RawPacket::new(&[0; 1]).is_some() && RawPacket::new(&[0; 31]).is_some());
        assert_eq!(RawPacket::new(&[0; 32]), None);
        let full = Packet::new(Port::Console, 0).with(&[1; 40]);
        assert_eq!((full.bytes().len(), full.room()), (PACKET_MAX, 0));
    }
}
