//! What queues have to know of frames that wait in them.

use super::Kind;
use crate::number::Profile;

/// Type byte of an entry: the bits of stigmergy and kind of key.
const WHERE: u8 = 0xe4;
const ROBOT: usize = 1;
const TOPIC: usize = 3;
const KEY: usize = 6;

/// Whether an entry of a stigmergy makes a waiting one useless: that of the same script, stigmergy and key with a lower clock, or
/// by the same robot with the same. At equal clocks of two robots both have to be heard, as that is a conflict.
#[inline(never)]
pub fn supersedes<P: Profile>(new: &[u8], waiting: &[u8]) -> bool {
    let ([new_type, ..], [old_type, ..]) = (new, waiting) else {
        return false;
    };
    let is_entry = |first: u8| Kind::of(first) == Some(Kind::Entry);
    let value = KEY + P::WORD_BYTES;
    let hash = value + P::WORD_BYTES;
    is_entry(*new_type)
        && is_entry(*old_type)
        && (new_type ^ old_type) & WHERE == 0
        && (byte(new, 5) ^ byte(waiting, 5)) & 0xf0 == 0
        && same(new, waiting, KEY, value)
        && (!P::FULL || same(new, waiting, hash, hash + 3))
        && match clock(new).cmp(&clock(waiting)) {
            core::cmp::Ordering::Greater => true,
            core::cmp::Ordering::Equal => same(new, waiting, ROBOT, TOPIC),
            core::cmp::Ordering::Less => false,
        }
}

/// Whether both are broadcasts on the same topic by the same robot.
#[inline(never)]
pub fn has_same_topic<P: Profile>(new: &[u8], waiting: &[u8]) -> bool {
    let is_broadcast = |frame| Kind::of(byte(frame, 0)) == Some(Kind::Broadcast);
    is_broadcast(new) && is_broadcast(waiting) && same(new, waiting, ROBOT, TOPIC + P::WORD_BYTES)
}

fn byte(frame: &[u8], at: usize) -> u8 {
    frame.get(at).copied().unwrap_or(0)
}

/// Whether both have the same bytes there.
fn same(new: &[u8], waiting: &[u8], from: usize, to: usize) -> bool {
    matches!((new.get(from..to), waiting.get(from..to)), (Some(new), Some(waiting)) if new == waiting)
}

/// Its bytes, high ones first.
fn clock(entry: &[u8]) -> [u8; 4] {
    [byte(entry, 0) & 0x18, byte(entry, 5) & 0x0f, byte(entry, 4), byte(entry, 3)]
}
