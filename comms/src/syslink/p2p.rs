//! Swarm messages in P2P frames: who sends, where that robot is, and the message.
//!
//! ```text
//! 0xb0 | robot (u16)                              | message     the position is unknown
//! 0xb1 | robot (u16) | x, y, z (i16, mm each)     | message
//! ```
//! Numbers have their least significant byte first. The radio has a checksum of its own.

use super::packet::P2P_MAX;

/// The P2P port of swarm messages. Not 0, which Bitcraze's examples use.
pub const SWARM_PORT: u8 = 11;

/// Most bytes of a message.
pub const SWARM_MESSAGE_MAX: usize = P2P_MAX - HEADER_MAX;

const HERE_UNKNOWN: u8 = 0xb0;
const HERE: u8 = 0xb1;
/// Tag, robot, position.
const HEADER_MAX: usize = 1 + 2 + 3 * 2;

/// Coordinates in mm, within 32 m of the origin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Position(pub [i16; 3]);

impl Position {
    /// The nearest whole mm; `None` farther than 32 m away, or where a coordinate is no number.
    pub fn from_mm(mm: [f32; 3]) -> Option<Self> {
        let limits = f32::from(i16::MIN)..=f32::from(i16::MAX);
        let within = mm.iter().all(|mm| limits.contains(mm));
        let nearest = |mm: f32| if mm < 0.0 { (mm - 0.5) as i16 } else { (mm + 0.5) as i16 };
        within.then(|| Position(mm.map(nearest)))
    }

    /// The coordinates in mm.
    pub fn mm(self) -> [f32; 3] {
        self.0.map(f32::from)
    }
}

/// A swarm message as one robot tells it to all others.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SwarmFrame<'a> {
    /// Who sends it.
    pub robot: u16,
    /// Where that is, if it knows.
    pub position: Option<Position>,
    /// 1 to [`SWARM_MESSAGE_MAX`] bytes.
    pub message: &'a [u8],
}

impl<'a> SwarmFrame<'a> {
    /// From the data of a P2P frame; `None` if it is something else.
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
        let mut rest = buffer.iter_mut();
        let mut length = 0;
        let mut put = |bytes: &[u8]| {
            rest.by_ref().zip(bytes).for_each(|(slot, byte)| *slot = *byte);
            length += bytes.len();
        };
        put(&[if self.position.is_some() { HERE } else { HERE_UNKNOWN }]);
        put(&self.robot.to_le_bytes());
        if let Some(Position(coordinates)) = self.position {
            coordinates.iter().for_each(|mm| put(&mm.to_le_bytes()));
        }
        put(self.message);
        buffer.get(..length)
    }
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

    /// By the table above.
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
    fn what_is_none() {
        let whole = [0xb1, 7, 0, 1, 0, 2, 0, 3, 0, 9];
        assert!(SwarmFrame::parse(&whole).is_some());
        // Cut off; another tag; more than any robot sends.
        assert!((0..whole.len()).all(|length| SwarmFrame::parse(&whole[..length]).is_none()));
        assert!((0..=255).all(|tag| {
            let known = tag == 0xb0 || tag == 0xb1;
            SwarmFrame::parse(&[&[tag], &whole[1..]].concat()).is_some() == known
        }));
        assert_eq!(SwarmFrame::parse(&[&[0xb0, 7, 0][..], &[1; 52]].concat()), None);
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
