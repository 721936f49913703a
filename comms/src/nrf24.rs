//! Swarm messages in the radio payloads of Zooids: the sender's id, its position on the table, and
//! the message.
//!
//! ```text
//! 0xb0 | robot (u16)                          | message     the position is unknown
//! 0xb1 | robot (u16) | x, y (i16, mm each)    | message
//! ```
//! Numbers have their least significant byte first. The radio has a checksum of its own. The first
//! byte differs from the types that the robots' base station and the C BittyBuzz send (3 to 6,
//! 0x10, 0xf0, 0xf1, 0xff).

/// The channel, 2488 MHz, which is above most Wi-Fi channels. The radio uses 2 Mbit/s and a
/// checksum of two bytes.
pub const CHANNEL: u8 = 88;
/// The address that all robots share, in the byte order of the radio's registers. Payloads have
/// dynamic length (`EN_DPL`). No robot acknowledges them, since all robots would do so at once.
pub const ADDRESS: [u8; 5] = [0x5a, 0x6f, 0x6f, 0x69, 0xd3];

/// The maximum length of a payload, in bytes: the nRF24L01+'s limit.
pub const PAYLOAD_MAX: usize = 32;
/// The maximum length of a message, in bytes.
pub const MESSAGE_MAX: usize = PAYLOAD_MAX - HEADER_MAX;

const HERE_UNKNOWN: u8 = 0xb0;
const HERE: u8 = 0xb1;
/// The length of the longest header: tag, robot, position.
const HEADER_MAX: usize = 1 + 2 + 2 * 2;

/// A swarm message from one robot to all others.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Payload<'a> {
    pub robot: u16,
    /// The sender's position on the table, x and y in mm; `None` if the sender does not know it.
    pub position: Option<[i16; 2]>,
    /// The message, 1 to [`MESSAGE_MAX`] bytes.
    pub message: &'a [u8],
}

impl<'a> Payload<'a> {
    /// Parses a payload; `None` if it has another format.
    pub fn parse(bytes: &'a [u8]) -> Option<Self> {
        let (position, robot, message) = match bytes {
            [HERE_UNKNOWN, r0, r1, message @ ..] => (None, [*r0, *r1], message),
            [HERE, r0, r1, x0, x1, y0, y1, message @ ..] => {
                let position = [[*x0, *x1], [*y0, *y1]].map(i16::from_le_bytes);
                (Some(position), [*r0, *r1], message)
            }
            _ => return None,
        };
        let fits = (1..=MESSAGE_MAX).contains(&message.len());
        fits.then_some(Payload { robot: u16::from_le_bytes(robot), position, message })
    }

    /// Writes the payload and returns its length; `None` if the message is empty or too long.
    pub fn write(&self, room: &mut [u8; PAYLOAD_MAX]) -> Option<usize> {
        if !(1..=MESSAGE_MAX).contains(&self.message.len()) {
            return None;
        }
        let [r0, r1] = self.robot.to_le_bytes();
        let [[x0, x1], [y0, y1]] = self.position.unwrap_or_default().map(i16::to_le_bytes);
        let tag = if self.position.is_some() { HERE } else { HERE_UNKNOWN };
        let header = [tag, r0, r1, x0, x1, y0, y1];
        let header = if self.position.is_some() { &header[..] } else { &[tag, r0, r1] };
        for (place, byte) in room.iter_mut().zip(header.iter().chain(self.message)) {
            *place = *byte;
        }
        Some(header.len() + self.message.len())
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;

    #[test]
    fn layouts() {
        let message = &[8, 5, 6][..];
        let mut room = [0xee; PAYLOAD_MAX];
        let unknown = Payload { robot: 0x1234, position: None, message };
        assert_eq!(unknown.write(&mut room), Some(6));
        assert_eq!(room[..6], [0xb0, 0x34, 0x12, 8, 5, 6]);
        assert_eq!(Payload::parse(&room[..6]), Some(unknown));
        let known = Payload { position: Some([300, -2]), ..unknown };
        assert_eq!(known.write(&mut room), Some(10));
        assert_eq!(room[..10], [0xb1, 0x34, 0x12, 0x2c, 1, 0xfe, 0xff, 8, 5, 6]);
        assert_eq!(Payload::parse(&room[..10]), Some(known));
    }

    #[test]
    fn a_message_has_its_limits() {
        let mut room = [0; PAYLOAD_MAX];
        let mut length =
            |message| Payload { robot: 7, position: Some([1, 2]), message }.write(&mut room);
        assert_eq!(length(&[]), None);
        assert_eq!(length(&[8; MESSAGE_MAX]), Some(PAYLOAD_MAX));
        assert_eq!(length(&[8; MESSAGE_MAX + 1]), None);
    }

    #[test]
    fn a_received_message_has_the_same_limits() {
        let message = [8; MESSAGE_MAX + 1];
        for header in [&[0xb0, 7, 0][..], &[0xb1, 7, 0, 1, 0, 2, 0]] {
            let position = (header.len() > 3).then_some([1, 2]);
            let bytes = [header, &message].concat();
            assert_eq!(Payload::parse(header), None);
            assert_eq!(Payload::parse(&bytes), None);
            let longest = Payload { robot: 7, position, message: &message[..MESSAGE_MAX] };
            assert_eq!(Payload::parse(&bytes[..bytes.len() - 1]), Some(longest));
        }
    }

    #[test]
    fn other_payloads_are_rejected() {
        // Truncated payloads, packets of a base station or of the C BittyBuzz, and noise.
        let whole = [0xb1, 7, 0, 1, 0, 2, 0, 8];
        assert!(Payload::parse(&whole).is_some());
        assert!((0..whole.len()).all(|length| Payload::parse(&whole[..length]).is_none()));
        for tag in (0..=255).filter(|tag| !(0xb0..=0xb1).contains(tag)) {
            assert_eq!(Payload::parse(&[tag, 250, 0, 0, 0, 0, 0, 8, 0]), None);
        }
    }
}
