//! Frames of fixed layout, and fragments.
//!
//! They are read and written in a buffer of fixed size, where no position has to be checked: on the AVR, a byte is then one
//! instruction.

use core::marker::PhantomData;

use super::word::{to_word, value};
use super::{
    CLOCK_MAX, Entry, FRAGMENT_HEAD, Fragment, Ignored, Kind, Message, PLAIN_MAX, STIGMERGIES,
    Script, Swarms,
};
use crate::number::{Profile, Word};
use crate::value::{Tag, Value};

const BROADCAST: u8 = 0x04;
const BEACON: u8 = 0x08;
const SWARMS: u8 = 0x09;
const FRAGMENT: u8 = 0x10;
/// Fragment: none follows.
const LAST: u8 = 0x08;
/// Fragment: its index.
const INDEX: u8 = 0x07;
/// Entry: the unit of the stigmergy's number plus one.
const STIGMERGY: u8 = 0x20;
/// Entry: bits 20 and 21 of the clock.
const CLOCK: u8 = 0x18;
/// Entry: the key is a string.
const STRING_KEY: u8 = 0x04;
/// Broadcast and entry: the tag of the value.
const VALUE: u8 = 0x03;

/// Where fields begin. Behind the type byte there is always the robot.
struct Layout<P>(PhantomData<P>);

impl<P: Profile> Layout<P> {
    const TOPIC: usize = 3;
    const BROADCAST_VALUE: usize = Self::TOPIC + P::WORD_BYTES;
    const BROADCAST_HASH: usize = Self::BROADCAST_VALUE + P::WORD_BYTES;
    const BROADCAST_END: usize = Self::BROADCAST_HASH + 3;
    const KEY: usize = 6;
    const ENTRY_VALUE: usize = Self::KEY + P::WORD_BYTES;
    const ENTRY_HASH: usize = Self::ENTRY_VALUE + P::WORD_BYTES;
    const ENTRY_END: usize = Self::ENTRY_HASH + if P::FULL { 3 } else { 0 };
    const BEACON_END: usize = 7;
    const SWARM_IDS: usize = 6;
}

/// A frame, the rest zero.
type Bytes = [u8; PLAIN_MAX];

impl<'a, P: Profile> Message<'a, P> {
    /// Reads a frame. Bytes behind what the message needs are ignored.
    pub fn decode(frame: &'a [u8], script: Script) -> Result<Self, Ignored> {
        let mut bytes: Bytes = [0; PLAIN_MAX];
        for (to, from) in bytes.iter_mut().zip(frame) {
            *to = *from;
        }
        let [first, _, _, b3, b4, b5, b6, ..] = bytes;
        let kind = Kind::of(first).ok_or(Ignored::Malformed)?;
        let swarms = b5 & 0x0f;
        let end = match kind {
            Kind::Entry => Layout::<P>::ENTRY_END,
            Kind::Broadcast => Layout::<P>::BROADCAST_END,
            Kind::Beacon => Layout::<P>::BEACON_END,
            Kind::Swarms if swarms == 0 || swarms > Swarms::capacity::<P>() => usize::MAX,
            Kind::Swarms => Layout::<P>::SWARM_IDS + 2 * usize::from(swarms),
            Kind::Fragment => FRAGMENT_HEAD + 1,
        };
        if frame.len() < end {
            return Err(Ignored::Malformed);
        }
        let robot = low(&bytes, 1);
        let [h0, h1, h2, h3] = script.hash.to_le_bytes();
        let (message, ours) = match kind {
            Kind::Entry => {
                let key = if first & STRING_KEY != 0 { Tag::STRING } else { Tag::INT };
                let entry = Entry {
                    stigmergy: u16::from((first / STIGMERGY).wrapping_sub(1)),
                    owner: robot,
                    clock: u32::from_le_bytes([b3, b4, b5 & 0x0f | (first & CLOCK) << 1, 0]),
                    key: value(key, word::<P>(&bytes, Layout::<P>::KEY), script)?,
                    value: value(
                        Tag::of(first & VALUE),
                        word::<P>(&bytes, Layout::<P>::ENTRY_VALUE),
                        script,
                    )?,
                };
                let ours = (b5 ^ h3) & 0xf0 == 0
                    && (!P::FULL || hashed(&bytes, Layout::<P>::ENTRY_HASH, script));
                (Message::Entry(entry), ours)
            }
            Kind::Broadcast => {
                let topic = word::<P>(&bytes, Layout::<P>::TOPIC);
                let broadcast = Message::Broadcast {
                    robot,
                    topic: value::<P>(Tag::STRING, topic, script)?.index() as u16,
                    value: value(
                        Tag::of(first & VALUE),
                        word::<P>(&bytes, Layout::<P>::BROADCAST_VALUE),
                        script,
                    )?,
                };
                (broadcast, hashed(&bytes, Layout::<P>::BROADCAST_HASH, script))
            }
            Kind::Beacon => (Message::Beacon { robot }, [b3, b4, b5, b6] == [h0, h1, h2, h3]),
            Kind::Swarms => {
                let ids = [low(&bytes, 6), low(&bytes, 8), low(&bytes, 10), low(&bytes, 12)];
                let swarms = Swarms { count: swarms, joined: b5 >> 4, ids };
                (Message::Swarms { robot, swarms }, [b3, b4] == [h0, h1])
            }
            Kind::Fragment => {
                let content = frame.get(FRAGMENT_HEAD..).unwrap_or(&[]);
                let (index, last) = (first & INDEX, first & LAST != 0);
                (Message::Fragment(Fragment { robot, number: b3, index, last, content }), true)
            }
        };
        if ours { Ok(message) } else { Err(Ignored::Foreign) }
    }

    /// Writes the frame and tells its length. `None` if there is no such frame, or no room for it.
    pub fn encode(&self, script: Script, frame: &mut [u8]) -> Option<usize> {
        let mut bytes: Bytes = [0; PLAIN_MAX];
        let [h0, h1, _, h3] = script.hash.to_le_bytes();
        let robot;
        let mut end;
        let mut content: &[u8] = &[];
        match *self {
            Message::Broadcast { robot: sender, topic, value } => {
                robot = sender;
                bytes[0] = BROADCAST | plain_tag(value)?;
                set_word::<P>(&mut bytes, Layout::<P>::TOPIC, Value::string(topic), script);
                set_word::<P>(&mut bytes, Layout::<P>::BROADCAST_VALUE, value, script);
                set_hash(&mut bytes, Layout::<P>::BROADCAST_HASH, script);
                end = Layout::<P>::BROADCAST_END;
            }
            Message::Entry(Entry { stigmergy, owner, clock, key, value }) => {
                robot = owner;
                let string = match key.tag() {
                    Tag::INT => 0,
                    Tag::STRING => STRING_KEY,
                    _ => return None,
                };
                if stigmergy >= STIGMERGIES || clock > CLOCK_MAX {
                    return None;
                }
                let [c0, c1, c2, _] = clock.to_le_bytes();
                let number = (stigmergy as u8 + 1).wrapping_mul(STIGMERGY);
                bytes[0] = number | c2 >> 1 & CLOCK | string | plain_tag(value)?;
                bytes[3] = c0;
                bytes[4] = c1;
                bytes[5] = c2 & 0x0f | h3 & 0xf0;
                set_word::<P>(&mut bytes, Layout::<P>::KEY, key, script);
                set_word::<P>(&mut bytes, Layout::<P>::ENTRY_VALUE, value, script);
                if P::FULL {
                    set_hash(&mut bytes, Layout::<P>::ENTRY_HASH, script);
                }
                end = Layout::<P>::ENTRY_END;
            }
            Message::Beacon { robot: sender } => {
                robot = sender;
                bytes[0] = BEACON;
                set_hash(&mut bytes, 3, script);
                bytes[6] = h3;
                end = Layout::<P>::BEACON_END;
            }
            Message::Swarms { robot: sender, swarms } => {
                robot = sender;
                if swarms.count > Swarms::capacity::<P>() {
                    return None;
                }
                bytes[0] = SWARMS;
                bytes[3] = h0;
                bytes[4] = h1;
                bytes[5] = swarms.count | swarms.joined << 4;
                let ids = swarms.ids.iter().flat_map(|id| id.to_le_bytes());
                for (to, from) in bytes.iter_mut().skip(Layout::<P>::SWARM_IDS).zip(ids) {
                    *to = from;
                }
                end = Layout::<P>::SWARM_IDS + 2 * usize::from(swarms.count);
            }
            Message::Fragment(fragment) => {
                robot = fragment.robot;
                let last = if fragment.last { LAST } else { 0 };
                bytes[0] = FRAGMENT | last | fragment.index & INDEX;
                bytes[3] = fragment.number;
                content = fragment.content;
                end = FRAGMENT_HEAD;
            }
        }
        let [r0, r1] = robot.to_le_bytes();
        bytes[1] = r0;
        bytes[2] = r1;
        let source = bytes.iter().take(end).chain(content);
        end += content.len();
        let room = frame.get_mut(..end)?;
        for (to, from) in room.iter_mut().zip(source) {
            *to = *from;
        }
        Some(end)
    }
}

/// The two bytes there.
#[inline(always)]
fn low(bytes: &Bytes, at: usize) -> u16 {
    u16::from_le_bytes([bytes[at], bytes[at + 1]])
}

/// The word there.
#[inline(always)]
fn word<P: Profile>(bytes: &Bytes, at: usize) -> P::Raw {
    P::literal_from_le([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
}

/// Whether there are the low bits of the script's hash.
#[inline(always)]
fn hashed(bytes: &Bytes, at: usize, script: Script) -> bool {
    let [h0, h1, h2, _] = script.hash.to_le_bytes();
    [bytes[at], bytes[at + 1], bytes[at + 2]] == [h0, h1, h2]
}

/// Puts the low bits of the script's hash there.
#[inline(always)]
fn set_hash(bytes: &mut Bytes, at: usize, script: Script) {
    [bytes[at], bytes[at + 1], bytes[at + 2], _] = script.hash.to_le_bytes();
}

/// Puts a value's word there.
#[inline(always)]
fn set_word<P: Profile>(bytes: &mut Bytes, at: usize, value: Value<P>, script: Script) {
    let word = to_word(value, script).to_u32().to_le_bytes();
    bytes[at] = word[0];
    bytes[at + 1] = word[1];
    if P::FULL {
        bytes[at + 2] = word[2];
        bytes[at + 3] = word[3];
    }
}

/// The tag of a value that fits a frame.
#[inline(always)]
fn plain_tag<P: Profile>(value: Value<P>) -> Option<u8> {
    if value.is_plain() { Some(value.tag().byte()) } else { None }
}
