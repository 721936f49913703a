//! Messages between robots: their conversion from and to frames. `docs/wire-format.md` describes
//! the format.
//!
//! A frame consists of a type byte, by which links distinguish it from their own frames, and of
//! fields of fixed size. Only values that need no heap fit a frame: nil, numbers and constant
//! strings. Other values travel in fragments, whose joined bytes are a [`content`].
//!
//! Every frame carries bits of the hash of its script, so that robots with other scripts ignore it.

mod check;
pub mod content;
pub(crate) mod frame;
mod plain;

mod waiting;

pub use check::crc16;
pub(crate) use waiting::TOPIC_BYTES;
pub use waiting::{Topics, is_broadcast, replaces, replaces_content, topic_of, topic_set};

use crate::number::Profile;
use crate::value::{Tag, Value};

/// The number of bytes of the longest frame in the tiny profile: a Kilobot's frame has its type
/// byte and nine more.
pub const TINY_FRAME: usize = 10;
/// The number of bytes of the longest frame in the full profile, which every link of such robots
/// can carry.
pub const FULL_FRAME: usize = 49;

/// The most swarms in a frame of the full profile; a frame of the tiny profile holds half of them.
pub const SWARMS_MAX: usize = 4;
/// The most fragments of a message.
pub const FRAGMENTS_MAX: u8 = 8;
/// The number of bytes of a fragment before its content.
pub const FRAGMENT_HEAD: usize = 4;
/// The version of the format. The script hash covers it, so that robots with another version count
/// as foreign.
pub const VERSION: u8 = 3;
/// The greatest clock of a stigmergy entry. The clock after it is 1.
pub const CLOCK_MAX: u32 = (1 << 22) - 1;
/// Entries of stigmergies with a number below this one in messages have a kind of frame of their
/// own. Those of other stigmergies travel in fragments.
pub const STIGMERGIES: u16 = 3;

/// The script of a robot, as far as messages need it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ScriptIdentity {
    pub hash: u32,
    /// The number of constant strings: the machine's own and the script's.
    pub strings: u16,
}

/// A message that fits one frame, or a fragment of a longer one.
#[derive(Clone, Copy, Debug)]
pub enum Message<'a, P: Profile> {
    /// `neighbors.broadcast`
    Broadcast {
        /// The sender.
        robot: u16,
        /// A constant string.
        topic: u16,
        /// nil, a number or a constant string.
        value: Value<P>,
    },
    /// An entry of a stigmergy, or a request for it.
    Entry(StigmergyEntry<P>),
    /// The announcement that a robot is present.
    Beacon {
        /// The sender.
        robot: u16,
    },
    /// A beacon of a robot that knows stigmergies, with the sum of their entries.
    Digest {
        /// The sender.
        robot: u16,
        /// The sum over its entries, of 24 bits. Equal sums mean equal replicas.
        digest: u32,
        /// The latest clock of a deletion that it has forgotten, 0 if there is none.
        floor: u32,
    },
    /// Memberships of a robot in swarms.
    Swarms {
        /// The sender.
        robot: u16,
        /// Some or all of its swarms, with its membership of each.
        swarms: Swarms,
    },
    /// A part of a message that is too long for one frame.
    Fragment(Fragment<'a>),
}

/// An entry of a stigmergy in a message.
#[derive(Clone, Copy, Debug)]
pub struct StigmergyEntry<P: Profile> {
    /// Number of the stigmergy in messages: the image may have a table of other numbers that the
    /// script uses for them.
    pub stigmergy: u16,
    /// The robot that wrote the value; in a request, the robot that sends it.
    pub owner: u16,
    /// The time of the put on the Lamport clock, at most [`CLOCK_MAX`]. 0 requests the entry of the
    /// key.
    pub clock: u32,
    /// An integer or a constant string.
    pub key: Value<P>,
    /// nil, a number or a constant string; nil in a request and in a deleted entry.
    pub value: Value<P>,
}

/// Some of a robot's swarms.
#[derive(Clone, Copy, Debug, Default)]
pub struct Swarms {
    count: u8,
    joined: u8,
    ids: [u16; SWARMS_MAX],
}

/// A part of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fragment<'a> {
    /// The sender.
    pub robot: u16,
    /// The message's number: the low byte of its content's check.
    pub number: u8,
    /// The position of the fragment in its message, below [`FRAGMENTS_MAX`].
    pub index: u8,
    /// True for the last fragment.
    pub last: bool,
    /// The bytes of the content in this fragment, at least one.
    pub content: &'a [u8],
}

/// A reason why a frame is no message for this robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ignored {
    /// The frame is from a robot that runs another script.
    Foreign,
    /// The frame is too short, or its type is unknown.
    Malformed,
}

/// The type byte of the first fragment, unless it is the last one, too.
pub const FRAGMENT: u8 = 0x10;
/// The bit of a fragment's type byte that is set in the last one.
const LAST: u8 = 0x08;
/// The bits of a fragment's type byte that hold its position in the message.
const INDEX: u8 = 0x07;

impl<'a> Fragment<'a> {
    /// Reads a fragment. Returns `None` if the frame is none, or has no content.
    #[inline]
    pub fn parse(frame: &'a [u8]) -> Option<Fragment<'a>> {
        let ([first, low, high, number], content) = frame.split_first_chunk()?;
        if first & !(LAST | INDEX) != FRAGMENT || content.is_empty() {
            return None;
        }
        Some(Fragment {
            robot: u16::from_le_bytes([*low, *high]),
            number: *number,
            index: first & INDEX,
            last: first & LAST != 0,
            content,
        })
    }

    /// Returns the bytes before the content.
    #[inline]
    pub fn head(&self) -> [u8; FRAGMENT_HEAD] {
        let last = if self.last { LAST } else { 0 };
        let [low, high] = self.robot.to_le_bytes();
        [FRAGMENT | last | self.index & INDEX, low, high, self.number]
    }
}

/// Kinds of frames, by ascending priority.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum FrameKind {
    /// The announcement that a robot is present.
    Beacon,
    /// A beacon with the digest of the sender's stigmergies.
    Digest,
    /// Memberships of a robot in swarms.
    Swarms,
    /// An entry of a stigmergy.
    Entry,
    /// A part of a longer message.
    Fragment,
    /// A broadcast.
    Broadcast,
}

impl FrameKind {
    /// Returns the kind of frames with that type byte; `None` if it is no frame of this format.
    #[one_copy]
    pub const fn of(type_byte: u8) -> Option<FrameKind> {
        Self::of_quickly(type_byte)
    }

    /// Returns the kind of a type byte, for callers where time is scarcer than flash.
    #[hot]
    pub(crate) const fn of_quickly(type_byte: u8) -> Option<FrameKind> {
        Some(match type_byte {
            0x04..=0x07 => FrameKind::Broadcast,
            0x08 => FrameKind::Beacon,
            0x09 => FrameKind::Swarms,
            0x0a => FrameKind::Digest,
            0x10..=0x1f => FrameKind::Fragment,
            0x20..=0x7f => FrameKind::Entry,
            _ => return None,
        })
    }
}

impl Swarms {
    /// Returns the most swarms that a frame of that profile holds.
    pub const fn capacity<P: Profile>() -> u8 {
        if P::FULL { SWARMS_MAX as u8 } else { SWARMS_MAX as u8 / 2 }
    }

    /// Returns the number of swarms.
    pub const fn count(&self) -> u8 {
        self.count
    }

    /// Adds a swarm, with true if the robot is in it. Returns false if no more swarms fit.
    pub fn push(&mut self, id: u16, joined: bool) -> bool {
        let Some(place) = self.ids.get_mut(usize::from(self.count)) else {
            return false;
        };
        *place = id;
        self.joined |= u8::from(joined) << self.count;
        self.count += 1;
        true
    }

    /// Returns the swarms, each with true if the robot is in it.
    pub fn iter(&self) -> impl Iterator<Item = (u16, bool)> {
        let mut joined = self.joined;
        self.ids.iter().take(usize::from(self.count)).map(move |id| {
            let bit = joined & 1 != 0;
            joined >>= 1;
            (*id, bit)
        })
    }
}

impl<P: Profile> Value<P> {
    /// Returns true if the value fits a frame: nil, a number or a constant string.
    #[hot]
    pub(crate) fn is_plain(self) -> bool {
        self.tag().byte() <= Tag::STRING.byte()
    }
}
