//! The packets that radios exchange.

use super::registers::Address;
use crate::Time;

/// The largest payload in bytes.
pub const PAYLOAD_MAX: usize = 32;

/// The format of a packet, which its receiver must share.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct PacketFormat {
    /// The frequency is 2400 + `channel` MHz.
    pub channel: u8,
    pub bits_per_second: u64,
    pub crc_bytes: usize,
    /// True if the packet has the control field of nine bits.
    pub enhanced: bool,
}

/// A packet, as one radio transmits it and others may receive it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Nrf24Packet {
    pub(super) format: PacketFormat,
    pub(super) address: Address,
    /// An identifier that distinguishes a new packet from a repeated one, 0 to 3.
    pub(super) id: u8,
    /// True if the receiver shall not acknowledge the packet.
    pub(super) no_ack: bool,
    pub(super) payload: Vec<u8>,
}

impl Nrf24Packet {
    /// Returns the channel, 0 to 127: the packet is sent at 2400 + channel MHz.
    pub fn channel(&self) -> u8 {
        self.format.channel
    }

    /// Returns the payload of 0 to 32 bytes.
    pub fn payload(&self) -> &[u8] {
        &self.payload
    }

    /// Returns the time on the air (product specification, 7.3): preamble, address, control field,
    /// payload, checksum.
    pub fn air_time(&self) -> Time {
        let PacketFormat { bits_per_second, crc_bytes, enhanced, .. } = self.format;
        let bytes = 1 + self.address.width() + self.payload.len() + crc_bytes;
        let bits = 8 * bytes as u64 + if enhanced { 9 } else { 0 };
        Time::of_ticks(bits, bits_per_second)
    }
}

/// A packet and the time of its transmission.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Transmission {
    /// The time of the first bit.
    pub begin: Time,
    /// The end of the last bit.
    pub end: Time,
    pub packet: Nrf24Packet,
}
