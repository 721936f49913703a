//! The comparison of frames, and of long messages, by which a queue replaces a waiting one with a
//! newer one.

use super::FrameKind;
use super::content::{BROADCAST, TEXT};
use super::{FRAGMENT, LAST};
use crate::number::Profile;
use crate::stamp::is_earlier;

/// The bits of an entry's type byte that hold the highest bits of the clock.
const CLOCK: u8 = 0x18;
const ROBOT: usize = 1;
const TOPIC: usize = 3;
const KEY: usize = 6;
/// The number of bytes of the check after the words of a frame.
const CHECK: usize = 3;

/// Returns true if the new frame, which is of that kind, makes a waiting frame useless.
///
/// An entry of a stigmergy replaces one of the same script, stigmergy and key that has a lower
/// clock, or the same clock and the same robot. At equal clocks of two robots both frames are kept,
/// because other robots must receive both to detect the conflict. A broadcast replaces a stale one
/// of the same robot on the same topic, that is one of an earlier step. A beacon replaces one of
/// the same robot.
#[one_copy]
pub fn replaces<P: Profile>(kind: FrameKind, new: &[u8], waiting: &[u8], is_stale: bool) -> bool {
    let words = 2 * P::WORD_BYTES;
    let (of_type, others) = match kind {
        // This is the most frequent case.
        FrameKind::Broadcast if !is_stale => return false,
        FrameKind::Broadcast => {
            let check = TOPIC + words;
            (0xfc, bytes(ROBOT, TOPIC + P::WORD_BYTES) | bytes(check, check + CHECK))
        }
        // The types of a beacon and of one with a digest differ in one bit. They share the first
        // byte of the hash.
        FrameKind::Beacon | FrameKind::Digest => (0xfd, bytes(ROBOT, ROBOT + 3)),
        // The mask has the stigmergy and the type of the key.
        FrameKind::Entry => {
            let check = KEY + words;
            let check = if P::FULL { bytes(check, check + CHECK) } else { 0 };
            (0xe4, bytes(KEY, KEY + P::WORD_BYTES) | check)
        }
        FrameKind::Swarms | FrameKind::Fragment => return false,
    };
    if !same(new, waiting, of_type, others) {
        return false;
    }
    let (Some(new), Some(waiting)) = (new.first_chunk(), waiting.first_chunk()) else {
        return false;
    };
    if kind != FrameKind::Entry {
        return true;
    }
    // The higher half of this byte belongs to the hash.
    if (new[5] ^ waiting[5]) & 0xf0 != 0 {
        return false;
    }
    let (new_clock, old_clock) = (clock(new), clock(waiting));
    is_earlier(old_clock, new_clock)
        || new_clock == old_clock
            && new[ROBOT] == waiting[ROBOT]
            && new[ROBOT + 1] == waiting[ROBOT + 1]
}

// The offsets in a content after its check: the kind; of a broadcast its topic; of an entry its
// stigmergy, owner, clock and key.
const CHECK_BYTES: usize = 2;
const CONTENT_NAME: usize = 1;
const CONTENT_OWNER: usize = 3;
const CONTENT_KEY: usize = 10;

/// Returns true for the content of a broadcast, and false for that of an entry of a stigmergy.
pub fn is_broadcast(content: &[u8]) -> bool {
    content.get(CHECK_BYTES) == Some(&BROADCAST)
}

/// Returns true if a new content, which this robot sends, makes a waiting one useless. An entry
/// replaces one of its key, because a robot's entries do not become older. A broadcast replaces a
/// stale one on its topic.
#[one_copy]
pub fn replaces_content<P: Profile>(new: &[u8], waiting: &[u8], is_stale: bool) -> bool {
    let is_entry = !is_broadcast(new);
    if !is_entry && !is_stale {
        return false;
    }
    let (Some(new), Some(waiting)) = (new.get(CHECK_BYTES..), waiting.get(CHECK_BYTES..)) else {
        return false;
    };
    let name = if is_entry { CONTENT_KEY } else { CONTENT_NAME };
    // The stigmergy, or nothing, and the tag and the word of the name.
    let stigmergy = if is_entry { bytes(CONTENT_NAME, CONTENT_OWNER) } else { 0 };
    if !same(new, waiting, 0xff, stigmergy | bytes(name, name + 1 + P::WORD_BYTES)) {
        return false;
    }
    // A text has its length after the tag.
    if P::FULL
        && let Some([TEXT, length, ..]) = new.get(name..)
    {
        let end = name + 2 + usize::from(*length);
        if new.get(name..end) != waiting.get(name..end) {
            return false;
        }
    }
    true
}

/// A set of topics: bit i stands for all topics whose number is i modulo 32. The number of a constant
/// is the low byte of its word in frames; that of a text, the sum of its length and its first
/// 32 bytes.
pub type Topics = u32;

/// The number of bytes by which topics differ. They are in the first fragment.
pub(crate) const TOPIC_BYTES: usize = 32;

/// Returns the set of all topics with that number.
#[inline(always)]
pub fn topic_set(number: u8) -> Topics {
    1 << (number & 31)
}

/// Returns the topic of a broadcast, of a long one if the frame is its first fragment; the empty set
/// for any other frame.
#[inline(always)]
pub fn topic_of<P: Profile>(frame: &[u8]) -> Topics {
    let topic = match frame {
        [0x04..=0x07, rest @ ..] => rest.get(TOPIC - 1),
        [first, _, _, _, _, _, BROADCAST, tag, length, text @ ..] if first & !LAST == FRAGMENT => {
            if P::FULL && *tag == TEXT {
                let text = text.iter().take(TOPIC_BYTES.min(usize::from(*length)));
                return topic_set(text.fold(*length, |sum, byte| sum.wrapping_add(*byte)));
            }
            // The low byte of the word.
            Some(length)
        }
        _ => None,
    };
    topic.map_or(0, |topic| topic_set(*topic))
}

/// Returns the clock of an entry.
#[one_copy]
fn clock([first, _, _, low, middle, high]: &[u8; 6]) -> u32 {
    u32::from_le_bytes([*low, *middle, high & 0x0f | (first & CLOCK) << 1, 0])
}

/// Returns a bit for each byte of a frame in that range. The lowest bit stands for the first byte
/// after the type.
const fn bytes(from: usize, to: usize) -> u16 {
    ((1_u32 << (to - 1)) - (1_u32 << (from - 1))) as u16
}

/// Returns true if both frames are equal in the bits `of_type` of the type and in the bytes
/// `others`, and have all of these bytes.
#[one_copy]
fn same(new: &[u8], waiting: &[u8], of_type: u8, others: u16) -> bool {
    let mut mask = of_type;
    let mut left = others;
    for (new, old) in new.iter().zip(waiting) {
        if (new ^ old) & mask != 0 {
            return false;
        }
        mask = if left & 1 != 0 { 0xff } else { 0 };
        left >>= 1;
    }
    // Both frames have all bytes.
    mask == 0 && left == 0
}
