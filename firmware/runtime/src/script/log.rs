//! What the script prints during a slice. It is told after the slice, so that no formatting or transport runs inside the
//! interpreter's loop.

use bittybuzz_comms::trace;
use heapless::Vec;

/// Bytes of records that a slice may print, a length byte before each.
const ROOM: usize = 1024;

/// A slice ends when so much is printed: the rest of the room is for what one more chunk of instructions may print.
const MUCH: usize = ROOM / 4;

/// Records of one slice.
pub struct Log {
    records: Vec<u8, ROOM>,
    lost: u32,
}

impl Log {
    /// Empty.
    pub fn new() -> Self {
        Log { records: Vec::new(), lost: 0 }
    }

    /// Adds a record. Where there is no room it is counted as lost.
    pub fn push(&mut self, record: &[u8]) {
        let length = u8::try_from(record.len()).ok();
        match length {
            Some(length) if self.records.len() + 1 + record.len() <= ROOM => {
                let _ = self.records.push(length);
                let _ = self.records.extend_from_slice(record);
            }
            _ => self.lost = self.lost.wrapping_add(1),
        }
    }

    /// Whether it is time to tell.
    pub fn is_much(&self) -> bool {
        self.records.len() >= MUCH
    }

    /// Gives all records to `sink` and forgets them.
    pub fn drain(&mut self, mut sink: impl FnMut(&[u8])) {
        let mut rest = self.records.as_slice();
        while let [length, tail @ ..] = rest
            && let Some((record, tail)) = tail.split_at_checked(usize::from(*length))
        {
            sink(record);
            rest = tail;
        }
        self.records.clear();
        if self.lost > 0 {
            sink(&trace::lost(self.lost));
            self.lost = 0;
        }
    }
}
