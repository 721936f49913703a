//! What queues have to know of frames that wait in them.

use super::Kind;
use crate::number::Profile;
use crate::stamp::is_earlier;

/// Type byte: that it is a broadcast.
const BROADCAST: u8 = 0xfc;
/// Type byte: stigmergy and kind of key.
const ENTRY: u8 = 0xe4;
/// Type byte of an entry: the highest bits of the clock.
const CLOCK: u8 = 0x18;
const ROBOT: usize = 1;
const TOPIC: usize = 3;
const KEY: usize = 6;
/// Bytes of the hash behind the robot of a beacon.
const HASH: usize = 4;

/// Whether a frame of that kind makes one useless that waits.
///
/// An entry of a stigmergy does that to one of the same script, stigmergy and key with a lower clock, or with the same by the same
/// robot; at equal clocks of two robots both have to be heard, as that is a conflict. A broadcast does it to one of the same
/// robot on the same topic that is stale, that is of an earlier step; a beacon does it to one of the same robot.
#[inline(never)]
pub fn replaces<P: Profile>(kind: Kind, new: &[u8], waiting: &[u8], is_stale: bool) -> bool {
    // Most often asked.
    if !is_stale && kind == Kind::Broadcast {
        return false;
    }
    let (Some(new_head), Some(head)) = (new.first_chunk(), waiting.first_chunk()) else {
        return false;
    };
    let [new_type, n1, n2, n3, n4, n5] = *new_head;
    let [old_type, o1, o2, o3, o4, o5] = *head;
    let word = P::WORD_BYTES;
    if matches!(kind, Kind::Beacon | Kind::Digest) {
        let waits = Kind::of(old_type);
        return matches!(waits, Some(Kind::Beacon | Kind::Digest))
            && same(new, waiting, ROBOT, ROBOT + 2 + HASH);
    }
    if kind == Kind::Broadcast {
        return (new_type ^ old_type) & BROADCAST == 0
            && same(new, waiting, ROBOT, TOPIC + word)
            && same(new, waiting, TOPIC + 2 * word, TOPIC + 2 * word + 3);
    }
    if kind != Kind::Entry
        || (new_type ^ old_type) & ENTRY != 0
        || (n5 ^ o5) & 0xf0 != 0
        || !same(new, waiting, KEY, KEY + word)
        || P::FULL && !same(new, waiting, KEY + 2 * word, KEY + 2 * word + 3)
    {
        return false;
    }
    let high = |first: u8, high: u8| high & 0x0f | (first & CLOCK) << 1;
    let new_clock = u32::from_le_bytes([n3, n4, high(new_type, n5), 0]);
    let old_clock = u32::from_le_bytes([o3, o4, high(old_type, o5), 0]);
    is_earlier(old_clock, new_clock) || new_clock == old_clock && n1 == o1 && n2 == o2
}

/// Whether both have the same bytes there.
#[inline(never)]
fn same(new: &[u8], waiting: &[u8], from: usize, to: usize) -> bool {
    matches!((new.get(from..to), waiting.get(from..to)), (Some(new), Some(waiting)) if new == waiting)
}
