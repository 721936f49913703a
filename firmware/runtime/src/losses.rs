//! The count of lost debug messages. A debug probe may be unplugged, so a message that finds no
//! room in the ring buffer is counted, and the number is sent once there is room again.

use core::sync::atomic::{AtomicU32, Ordering};

/// The length of the arguments of the record that reports lost messages, in bytes.
const LOST: usize = 5;

/// Returns the maximum length of a message in bytes: its arguments, its number, time and length,
/// and one byte in seven for the encoding (rzCOBS).
const fn size_of_message(arguments: usize) -> usize {
    24 + arguments + arguments / 4
}

/// The start of RTT's control block, in the layout that the probe expects and defmt-rtt defines
/// (`Header`), up to the read offset of the first channel.
#[repr(C)]
pub struct ControlBlock {
    id: [u8; 16],
    channels: [u32; 2],
    name: u32,
    buffer: u32,
    size: u32,
    write: AtomicU32,
    /// The only field that the probe changes.
    read: AtomicU32,
}

/// The number of messages that were lost and not reported yet. Only tasks of one executor share it.
pub struct Losses(AtomicU32);

impl Losses {
    /// Returns the state without losses.
    pub const fn new() -> Self {
        Losses(AtomicU32::new(0))
    }

    /// Decides whether a message with `arguments` bytes of arguments is written. Returns the number
    /// of messages that were lost before; the caller has to report it first. Returns `None` if
    /// there is no room for both: this message is lost, too.
    pub fn admit(&self, arguments: usize, block: &ControlBlock) -> Option<u32> {
        let [write, read] = [&block.write, &block.read].map(|at| at.load(Ordering::Relaxed));
        self.admit_to_ring(arguments, block.size, write, read)
    }

    /// Decides as `admit` does, for a ring buffer of `size` bytes whose next bytes are written at
    /// `write` and read at `read`.
    fn admit_to_ring(&self, arguments: usize, size: u32, write: u32, read: u32) -> Option<u32> {
        let lost = self.0.load(Ordering::Relaxed);
        let mut needed = size_of_message(arguments);
        if lost != 0 {
            needed += size_of_message(LOST);
        }
        // One byte stays free, because a full buffer would look like an empty one.
        let end = if read > write { read } else { read + size };
        let has_room = needed < (end - write) as usize;
        self.0.store(if has_room { 0 } else { lost.saturating_add(1) }, Ordering::Relaxed);
        has_room.then_some(lost)
    }
}

impl Default for Losses {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::{LOST, Losses, size_of_message};

    #[test]
    fn a_message_needs_room_and_one_byte_more() {
        let needed = size_of_message(10) as u32;
        for (write, read) in [(0, 0), (100, 100), (511, 511), (500, 20), (20, 500)] {
            let room = if read > write { read - write } else { read + 512 - write };
            let is_admitted = Losses::new().admit_to_ring(10, 512, write, read).is_some();
            assert_eq!(is_admitted, needed < room, "{write} {read}");
        }
        let admit = |room: u32| Losses::new().admit_to_ring(10, 512, 512 - room, 0);
        assert_eq!([admit(needed), admit(needed + 1)], [None, Some(0)]);
    }

    #[test]
    fn losses_are_reported_once_and_need_room_themselves() {
        let losses = Losses::new();
        assert_eq!(losses.admit_to_ring(4, 512, 0, 1), None);
        assert_eq!(losses.admit_to_ring(4, 512, 0, 1), None);
        let room = (size_of_message(4) + size_of_message(LOST)) as u32;
        assert_eq!(losses.admit_to_ring(4, 512, 0, room), None, "only the message itself fits");
        assert_eq!(losses.admit_to_ring(4, 512, 0, room + 1), Some(3));
        assert_eq!(losses.admit_to_ring(4, 512, 0, room + 1), Some(0));
    }
}
