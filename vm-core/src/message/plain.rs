//! Frames: from messages and to messages.

use super::seal::Frame;
use super::{
    CLOCK_MAX, Entry, FRAGMENT_HEAD, Fragment, Ignored, Kind, Message, STIGMERGIES, Script, Swarms,
};
use crate::number::Profile;
use crate::value::{Tag, Value};

const BROADCAST: u8 = 0x04;
const BEACON: u8 = 0x08;
const SWARMS: u8 = 0x09;
const FRAGMENT: u8 = 0x10;
/// Fragment: none follows.
const LAST: u8 = 0x08;
/// Fragment: which part.
const INDEX: u8 = 0x07;
/// Entry: the unit of the stigmergy's number plus one.
const STIGMERGY: u8 = 0x20;

impl<'a, P: Profile> Message<'a, P> {
    /// Reads a frame. Bytes behind what the message needs are ignored.
    pub fn decode(bytes: &'a [u8], script: Script) -> Result<Self, Ignored> {
        let mut frame = Frame::<P>::EMPTY;
        for (to, from) in frame.bytes.iter_mut().zip(bytes) {
            *to = *from;
        }
        frame.open(bytes.len(), &script)?;
        let robot = frame.number(Frame::<P>::ROBOT);
        let [first, _, _, b3, b4, b5, ..] = frame.bytes;
        Ok(match frame.kind {
            Kind::Beacon => Message::Beacon { robot },
            Kind::Swarms => {
                let ids = [frame.number(6), frame.number(8), frame.number(10), frame.number(12)];
                Message::Swarms { robot, swarms: Swarms { count: b5 & 0x0f, joined: b5 >> 4, ids } }
            }
            Kind::Fragment => Message::Fragment(Fragment {
                robot,
                number: b3,
                index: first & INDEX,
                last: first & LAST != 0,
                content: bytes.get(FRAGMENT_HEAD..).unwrap_or(&[]),
            }),
            Kind::Broadcast => Message::Broadcast {
                robot,
                topic: frame.number(Frame::<P>::TOPIC),
                value: frame.value(Frame::<P>::TOPIC + P::WORD_BYTES),
            },
            Kind::Entry => Message::Entry(Entry {
                stigmergy: u16::from((first / STIGMERGY).wrapping_sub(1)),
                owner: robot,
                clock: u32::from_le_bytes([b3, b4, b5, 0]),
                key: frame.key(),
                value: frame.value(Frame::<P>::KEY + P::WORD_BYTES),
            }),
        })
    }

    /// Writes the frame and tells its length. `None` if there is no such frame, or no room for it.
    pub fn encode(&self, script: Script, bytes: &mut [u8]) -> Option<usize> {
        let mut frame = Frame::<P>::EMPTY;
        let (first, robot) = match *self {
            Message::Beacon { robot } => {
                frame.kind = Kind::Beacon;
                (BEACON, robot)
            }
            Message::Swarms { robot, swarms } => {
                frame.kind = Kind::Swarms;
                frame.bytes[5] = swarms.count | swarms.joined << 4;
                let [a, b, c, d] = swarms.ids;
                frame.set_number(6, a);
                frame.set_number(8, b);
                if P::FULL {
                    frame.set_number(10, c);
                    frame.set_number(12, d);
                }
                (SWARMS, robot)
            }
            Message::Fragment(fragment) => {
                frame.kind = Kind::Fragment;
                frame.bytes[3] = fragment.number;
                (
                    FRAGMENT | if fragment.last { LAST } else { 0 } | fragment.index & INDEX,
                    fragment.robot,
                )
            }
            Message::Broadcast { robot, topic, value } => {
                frame.kind = Kind::Broadcast;
                frame.set_number(Frame::<P>::TOPIC, topic);
                frame.set_value(Frame::<P>::TOPIC + P::WORD_BYTES, value);
                (BROADCAST | plain_tag(value)?, robot)
            }
            Message::Entry(Entry { stigmergy, owner, clock, key, value }) => {
                frame.kind = Kind::Entry;
                let string = match key.tag() {
                    Tag::INT => 0,
                    Tag::STRING => Frame::<P>::STRING_KEY,
                    _ => return None,
                };
                if stigmergy >= STIGMERGIES || clock > CLOCK_MAX {
                    return None;
                }
                frame.set_number(3, clock as u16);
                frame.bytes[5] = (clock >> 16) as u8;
                frame.set_value(Frame::<P>::KEY, key);
                frame.set_value(Frame::<P>::KEY + P::WORD_BYTES, value);
                ((stigmergy as u8 + 1).wrapping_mul(STIGMERGY) | string | plain_tag(value)?, owner)
            }
        };
        frame.bytes[0] = first;
        frame.set_number(Frame::<P>::ROBOT, robot);
        frame.seal(&script);
        let length = frame.length()?;
        let (head, rest) = bytes.split_at_mut_checked(length)?;
        for (to, from) in head.iter_mut().zip(&frame.bytes) {
            *to = *from;
        }
        if let Message::Fragment(Fragment { content, .. }) = self {
            if content.is_empty() {
                return None;
            }
            rest.get_mut(..content.len())?.copy_from_slice(content);
            return Some(length.wrapping_add(content.len()));
        }
        Some(length)
    }
}

/// The tag of a value that fits a frame.
#[inline(always)]
fn plain_tag<P: Profile>(value: Value<P>) -> Option<u8> {
    if value.is_plain() { Some(value.tag().byte()) } else { None }
}
