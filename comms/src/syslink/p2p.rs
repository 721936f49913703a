//! The payloads of P2P frames: swarm messages with the id and the position of the sender, and
//! pings, which test the radio between two robots.
//!
//! ```text
//! 0xb0 | robot (u16)                              | message     the position is unknown
//! 0xb1 | robot (u16) | x, y, z (i16, mm each)     | message
//! 0xb2 | robot (u16) | anything                                 a ping for this robot
//! 0xb3 | robot (u16) | the same                                 the answer of this robot
//! ```
//! Numbers have their least significant byte first. The payload needs no checksum, since the radio
//! has its own.

use super::packet::P2P_MAX;

/// The P2P port of swarm messages and pings. Bitcraze's examples use port 0, and its token ring
/// uses port 15 (crazyflie-firmware, token_ring.h).
pub const SWARM_PORT: u8 = 11;

/// The maximum length of a message, in bytes.
pub const SWARM_MESSAGE_MAX: usize = P2P_MAX - HEADER_MAX;

const HERE_UNKNOWN: u8 = 0xb0;
const HERE: u8 = 0xb1;
const PING: u8 = 0xb2;
const ANSWER: u8 = 0xb3;
/// The length of the longest header: tag, robot, position.
const HEADER_MAX: usize = 1 + 2 + 3 * 2;

/// Coordinates in mm, at most 32 m from the origin in each direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Position(pub [i16; 3]);

impl Position {
    /// Rounds to whole mm; `None` if a coordinate is beyond 32 m or not a number.
    pub fn from_mm(mm: [f32; 3]) -> Option<Self> {
        let limits = f32::from(i16::MIN)..=f32::from(i16::MAX);
        let within = mm.iter().all(|mm| limits.contains(mm));
        let nearest = |mm: f32| if mm < 0.0 { (mm - 0.5) as i16 } else { (mm + 0.5) as i16 };
        within.then(|| Position(mm.map(nearest)))
    }

    /// Returns the coordinates in mm.
    pub fn mm(self) -> [f32; 3] {
        self.0.map(f32::from)
    }
}

/// A swarm message from one robot to all others.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SwarmFrame<'a> {
    pub robot: u16,
    /// The sender's position; `None` if the sender does not know it.
    pub position: Option<Position>,
    /// The message, 1 to [`SWARM_MESSAGE_MAX`] bytes.
    pub message: &'a [u8],
}

impl<'a> SwarmFrame<'a> {
    /// Parses the data of a P2P frame; `None` if it has another format.
    pub fn parse(data: &'a [u8]) -> Option<Self> {
        let (position, [r0, r1], message) = match data {
            [HERE_UNKNOWN, r0, r1, message @ ..] => (None, [*r0, *r1], message),
            [HERE, r0, r1, x0, x1, y0, y1, z0, z1, message @ ..] => {
                let position = [[*x0, *x1], [*y0, *y1], [*z0, *z1]].map(i16::from_le_bytes);
                (Some(Position(position)), [*r0, *r1], message)
            }
            _ => return None,
        };
        let fits = (1..=SWARM_MESSAGE_MAX).contains(&message.len());
        fits.then_some(SwarmFrame { robot: u16::from_le_bytes([r0, r1]), position, message })
    }

    /// Writes the data of a P2P frame; `None` if the message is empty or too long.
    pub fn write<'b>(&self, buffer: &'b mut [u8; P2P_MAX]) -> Option<&'b [u8]> {
        if !(1..=SWARM_MESSAGE_MAX).contains(&self.message.len()) {
            return None;
        }
        let tag = if self.position.is_some() { HERE } else { HERE_UNKNOWN };
        let mut position = [0; 3 * 2];
        let mut position_bytes = &[][..];
        if let Some(Position(coordinates)) = self.position {
            let bytes = coordinates.into_iter().flat_map(i16::to_le_bytes);
            position.iter_mut().zip(bytes).for_each(|(slot, byte)| *slot = byte);
            position_bytes = &position;
        }
        concat(buffer, [&[tag], &self.robot.to_le_bytes(), position_bytes, self.message])
    }
}

/// A ping or the answer to one. They have different tags, so that no robot answers an answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Ping<'a> {
    /// The robot that the ping addresses, or that answers.
    pub robot: u16,
    /// True for the answer.
    pub is_answer: bool,
    /// The data, at most [`PING_MAX`] bytes. The answer repeats them.
    pub data: &'a [u8],
}

/// The maximum length of a ping's data, in bytes.
pub const PING_MAX: usize = P2P_MAX - 3;

impl<'a> Ping<'a> {
    /// Parses the data of a P2P frame; `None` if it has another format.
    pub fn parse(data: &'a [u8]) -> Option<Self> {
        let [tag @ (PING | ANSWER), r0, r1, data @ ..] = data else { return None };
        let (robot, is_answer) = (u16::from_le_bytes([*r0, *r1]), *tag == ANSWER);
        (data.len() <= PING_MAX).then_some(Ping { robot, is_answer, data })
    }

    /// Writes the data of a P2P frame; `None` if the ping's data is too long.
    pub fn write<'b>(&self, buffer: &'b mut [u8; P2P_MAX]) -> Option<&'b [u8]> {
        let tag = if self.is_answer { ANSWER } else { PING };
        concat(buffer, [&[tag], &self.robot.to_le_bytes(), self.data, &[]])
    }
}

/// Concatenates the parts in `buffer`; `None` if they do not fit.
fn concat<'b>(buffer: &'b mut [u8; P2P_MAX], parts: [&[u8]; 4]) -> Option<&'b [u8]> {
    let mut rest = buffer.iter_mut();
    let mut length = 0;
    for part in parts {
        rest.by_ref().zip(part).for_each(|(slot, byte)| *slot = *byte);
        length += part.len();
    }
    buffer.get(..length)
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use std::vec;
    use std::vec::Vec;

    fn written(frame: SwarmFrame<'_>) -> Option<Vec<u8>> {
        frame.write(&mut [0xee; P2P_MAX]).map(<[u8]>::to_vec)
    }

    /// The bytes follow the table at the head of this file.
    #[test]
    fn layouts() {
        let message = &[4, 5, 6][..];
        for (position, bytes) in [
            (None, vec![0xb0, 0x34, 0x12, 4, 5, 6]),
            (
                Some(Position([1500, -2, -32768])),
                vec![0xb1, 0x34, 0x12, 0xdc, 0x05, 0xfe, 0xff, 0x00, 0x80, 4, 5, 6],
            ),
        ] {
            let frame = SwarmFrame { robot: 0x1234, position, message };
            assert_eq!(written(frame), Some(bytes.clone()));
            assert_eq!(SwarmFrame::parse(&bytes), Some(frame));
        }
    }

    #[test]
    fn a_message_has_its_limits() {
        let frame = |message| SwarmFrame { robot: 7, position: Some(Position([1; 3])), message };
        assert_eq!(written(frame(&[])), None);
        assert_eq!(written(frame(&[0; SWARM_MESSAGE_MAX + 1])), None);
        assert_eq!(written(frame(&[0; SWARM_MESSAGE_MAX])).map(|bytes| bytes.len()), Some(P2P_MAX));
    }

    #[test]
    fn a_received_message_has_the_same_limits() {
        let message = [9; SWARM_MESSAGE_MAX + 1];
        for header in [&[0xb0, 7, 0][..], &[0xb1, 7, 0, 1, 0, 2, 0, 3, 0]] {
            let position = (header.len() > 3).then_some(Position([1, 2, 3]));
            let bytes = [header, &message].concat();
            assert_eq!(SwarmFrame::parse(header), None);
            assert_eq!(SwarmFrame::parse(&bytes), None);
            let longest = SwarmFrame { robot: 7, position, message: &message[..SWARM_MESSAGE_MAX] };
            assert_eq!(SwarmFrame::parse(&bytes[..bytes.len() - 1]), Some(longest));
        }
    }

    #[test]
    fn other_frames_are_rejected() {
        let whole = [0xb1, 7, 0, 1, 0, 2, 0, 3, 0, 9];
        assert!(SwarmFrame::parse(&whole).is_some());
        // Truncated frames and other tags are rejected.
        assert!((0..whole.len()).all(|length| SwarmFrame::parse(&whole[..length]).is_none()));
        assert!((0..=255).all(|tag| {
            let known = tag == 0xb0 || tag == 0xb1;
            SwarmFrame::parse(&[&[tag], &whole[1..]].concat()).is_some() == known
        }));
    }

    /// The bytes follow the table at the head of this file.
    #[test]
    fn a_ping_and_its_answer() {
        let ping = |is_answer, data| Ping { robot: 0x1234, is_answer, data };
        for (ping, bytes) in [
            (ping(false, &b"hi"[..]), &[0xb2, 0x34, 0x12, b'h', b'i'][..]),
            (ping(true, b"hi"), &[0xb3, 0x34, 0x12, b'h', b'i']),
            (ping(true, b""), &[0xb3, 0x34, 0x12]),
        ] {
            assert_eq!(ping.write(&mut [0; P2P_MAX]), Some(bytes));
            assert_eq!(Ping::parse(bytes), Some(ping));
            assert_eq!(SwarmFrame::parse(bytes), None);
        }
        assert_eq!(Ping::parse(&[0xb2, 7]), None);
        assert_eq!(Ping::parse(&[0xb1, 7, 0, 1]), None);
        assert_eq!(Ping::parse(&[0xb2; P2P_MAX + 1]), None);
        let longest = ping(false, &[1; PING_MAX]);
        let mut buffer = [0; P2P_MAX];
        let bytes = longest.write(&mut buffer).expect("it fits");
        assert_eq!((bytes.len(), Ping::parse(bytes)), (P2P_MAX, Some(longest)));
        assert_eq!(ping(false, &[1; PING_MAX + 1]).write(&mut [0; P2P_MAX]), None);
    }

    #[test]
    fn positions_are_rounded_and_have_a_limit() {
        let position = |mm| Position::from_mm([mm, 0.0, 0.0]).map(|position| position.0[0]);
        assert_eq!(position(1.4), Some(1));
        assert_eq!(position(-1.6), Some(-2));
        assert_eq!(position(-0.4), Some(0));
        assert_eq!(position(32767.0), Some(32767));
        assert_eq!(position(32767.6), None);
        // Every position that can be received can be sent.
        assert_eq!(position(-32768.0), Some(-32768));
        assert_eq!(position(-32768.6), None);
        assert_eq!(position(f32::NAN), None);
        assert_eq!(position(f32::NEG_INFINITY), None);
    }
}
