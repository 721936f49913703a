//! Failing allocations on request, and counters of work, for tests: see feature `torture`.

use core::cell::Cell;

use crate::bytecode::ByteCode;
use crate::number::Profile;

/// An image that counts the reads of its bytes. With [`Vm::accesses`](crate::Vm::accesses) the
/// count measures the work of an instruction, the same on every host.
#[derive(Debug, Clone, Copy)]
pub struct CountedCode<'a> {
    bytes: &'a [u8],
    reads: &'a Cell<u64>,
}

impl<'a> CountedCode<'a> {
    /// Counts the reads of these bytes in a cell.
    pub fn new(bytes: &'a [u8], reads: &'a Cell<u64>) -> Self {
        CountedCode { bytes, reads }
    }
}

impl ByteCode for CountedCode<'_> {
    type Slots<P: Profile, const SLOTS: usize> = P::Slots<SLOTS>;

    fn len(&self) -> usize {
        self.bytes.len()
    }

    fn byte(&self, at: usize) -> u8 {
        self.reads.set(self.reads.get() + 1);
        ByteCode::byte(&self.bytes, at)
    }
}

/// The failures that are added to allocations.
#[derive(Debug, Clone, Copy, Default)]
pub struct Torture {
    /// Every allocation collects first.
    pub collect_always: bool,
    /// Collections stop and go on between slices, as on chips with much memory. The machine must
    /// not be inspected then while one is running. Together with `collect_always`, one begins before
    /// each instruction after an allocation.
    pub pauses_collections: bool,
    /// The allocation of that number, counted from 0, fails.
    pub fail_at: Option<u32>,
    /// The number of allocations so far.
    pub allocations: u32,
}

impl Torture {
    /// No failures, which is the default.
    pub(crate) const NONE: Torture =
        Torture { collect_always: false, pauses_collections: false, fail_at: None, allocations: 0 };

    /// Counts an allocation and returns true if it must fail.
    pub(crate) fn refuses(&mut self) -> bool {
        self.allocations += 1;
        self.fail_at == Some(self.allocations - 1)
    }
}
