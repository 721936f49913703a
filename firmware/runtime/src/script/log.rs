//! The lines that the script prints during a slice. They are reported after the slice, so that no
//! formatting or transport runs inside the interpreter's loop.

use bittybuzz_comms::trace;

/// The records of one slice, each after a byte with its length.
pub struct Log {
    room: &'static mut [u8],
    used: usize,
    lost: u32,
}

impl Log {
    /// Returns an empty log in `room`.
    pub fn new(room: &'static mut [u8]) -> Self {
        Log { room, used: 0, lost: 0 }
    }

    /// Adds a record. If there is no room, counts the record as lost and returns false.
    pub fn push(&mut self, record: &[u8]) -> bool {
        let rest = self.room.get_mut(self.used..).unwrap_or_default();
        let (Ok(length), Some((first, place))) =
            (u8::try_from(record.len()), rest.split_first_mut())
        else {
            self.lost = self.lost.wrapping_add(1);
            return false;
        };
        let Some(place) = place.get_mut(..record.len()) else {
            self.lost = self.lost.wrapping_add(1);
            return false;
        };
        *first = length;
        place.iter_mut().zip(record).for_each(|(to, from)| *to = *from);
        self.used += 1 + record.len();
        true
    }

    /// Returns true if the lines should be reported now: the rest of the room is for the output of
    /// one more chunk of instructions.
    pub fn is_much(&self) -> bool {
        self.used > self.room.len() / 4
    }

    /// Passes all records to `sink` and clears the log.
    pub fn drain(&mut self, mut sink: impl FnMut(&[u8])) {
        let mut rest = self.room.get(..self.used).unwrap_or_default();
        while let [length, tail @ ..] = rest
            && let Some((record, tail)) = tail.split_at_checked(usize::from(*length))
        {
            sink(record);
            rest = tail;
        }
        self.used = 0;
        if self.lost > 0 {
            sink(&trace::lost(self.lost));
            self.lost = 0;
        }
    }
}
