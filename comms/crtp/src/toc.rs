//! The tables of contents of logs and parameters: commands of channel 0, protocol version 4 and
//! later. Sources: log.c and param_logic.c of crazyflie-firmware.

use crate::fields::Fields;
use crate::packet::{DATA_MAX, Packet, Port};
use crate::refusal::Refusal;

/// Commands of channel 0.
const GET_ITEM: u8 = 2;
const GET_INFO: u8 = 3;

/// An entry of a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct TocEntry {
    pub group: &'static str,
    pub name: &'static str,
    /// The type byte, with access bits in the table of parameters.
    pub code: u8,
}

impl TocEntry {
    /// Returns true if both names fit a packet after the command, the id and the type.
    pub const fn fits(&self) -> bool {
        let names = self.group.len() + 1 + self.name.len() + 1;
        names <= DATA_MAX - 4
    }
}

/// Answers a request for the number of entries, or for one of them. `limits` follow the number and
/// the checksum.
pub(crate) fn answer(
    port: Port,
    data: &[u8],
    crc: u32,
    count: u16,
    limits: &[u8],
    entry: impl Fn(u16) -> Option<TocEntry>,
) -> Result<Packet, Refusal> {
    let mut fields = Fields::new(data);
    let packet = Packet::new(port, 0);
    match fields.byte()? {
        GET_INFO => {
            fields.end()?;
            let packet = packet.with(&[GET_INFO]).with(&count.to_le_bytes());
            Ok(packet.with(&crc.to_le_bytes()).with(limits))
        }
        GET_ITEM => {
            let id = fields.u16()?;
            fields.end()?;
            let packet = packet.with(&[GET_ITEM]);
            // An answer without id says that there is no such entry.
            let Some(TocEntry { group, name, code }) = entry(id) else { return Ok(packet) };
            let packet = packet.with(&id.to_le_bytes()).with(&[code]);
            Ok(packet.with(group.as_bytes()).with(&[0]).with(name.as_bytes()).with(&[0]))
        }
        _ => Err(Refusal::Unknown),
    }
}

/// The checksum of a table, by which ground stations recognize one that they know.
///
/// CRC-32 as in zip, from the last bit on without a table: the compiler computes it.
#[derive(Clone, Copy)]
pub(crate) struct Crc(u32);

impl Crc {
    pub const fn new() -> Self {
        Crc(u32::MAX)
    }

    /// Returns the checksum with one more entry.
    pub const fn with(self, entry: &TocEntry) -> Self {
        self.text(entry.group).text(entry.name).byte(entry.code)
    }

    pub const fn value(self) -> u32 {
        !self.0
    }

    const fn text(self, text: &str) -> Self {
        let mut rest = text.as_bytes();
        let mut crc = self;
        while let [byte, others @ ..] = rest {
            crc = crc.byte(*byte);
            rest = others;
        }
        crc.byte(0)
    }

    const fn byte(self, byte: u8) -> Self {
        let mut crc = self.0 ^ byte as u32;
        let mut bit = 0;
        while bit < 8 {
            crc = if crc & 1 == 0 { crc >> 1 } else { crc >> 1 ^ 0xedb8_8320 };
            bit += 1;
        }
        Crc(crc)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The check value of CRC-32/ISO-HDLC is that of the digits 1 to 9.
    #[test]
    fn the_checksum_is_crc_32() {
        let crc = b"123456789".iter().fold(Crc::new(), |crc, byte| crc.byte(*byte));
        assert_eq!(crc.value(), 0xcbf4_3926);
    }
}
