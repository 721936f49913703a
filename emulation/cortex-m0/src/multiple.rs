//! Loads and stores of several registers. Without a value there is no memory.

use bittybuzz_chips::Board;

use crate::bus::Bus;
use crate::registers::{Core, LR, SP};

/// Of an instruction that pushes: LR.
const LINK: u32 = 1 << 8;

impl Core {
    /// Those of R0 to R7 whose bits are set, and LR for bit 8.
    pub fn push<B: Board>(&mut self, bus: &mut Bus<B>, list: u32) -> Option<()> {
        let start = self.r[SP].wrapping_sub(4 * list.count_ones());
        let end = self.store_from(bus, start, list & !LINK)?;
        if list & LINK != 0 {
            bus.write_word(end, self.r[LR])?;
        }
        self.r[SP] = start;
        Some(())
    }

    pub fn pop<B: Board>(&mut self, bus: &mut Bus<B>, list: u32) -> Option<()> {
        self.r[SP] = self.load_from(bus, self.r[SP], list)?;
        Some(())
    }

    /// The same, and what is to be branched to.
    pub fn pop_to<B: Board>(&mut self, bus: &mut Bus<B>, list: u32) -> Option<u32> {
        let end = self.load_from(bus, self.r[SP], list)?;
        let to = bus.read_word(end)?;
        self.r[SP] = end.wrapping_add(4);
        Some(to)
    }

    pub fn store_many<B: Board>(&mut self, bus: &mut Bus<B>, base: u8, list: u32) -> Option<()> {
        let end = self.store_from(bus, self.get(base), list)?;
        self.set(base, end);
        Some(())
    }

    pub fn load_many<B: Board>(&mut self, bus: &mut Bus<B>, base: u8, list: u32) -> Option<()> {
        let end = self.load_from(bus, self.get(base), list)?;
        // A base that is loaded keeps what was loaded (A6.7.25).
        if list >> base & 1 == 0 {
            self.set(base, end);
        }
        Some(())
    }

    /// Stores those of R0 to R7 whose bits are set, and tells where the last one ends.
    fn store_from<B: Board>(&self, bus: &mut Bus<B>, start: u32, list: u32) -> Option<u32> {
        let (mut address, mut list) = (start, list);
        while list != 0 {
            bus.write_word(address, self.get(list.trailing_zeros() as u8))?;
            address = address.wrapping_add(4);
            list &= list - 1;
        }
        Some(address)
    }

    /// Loads those of R0 to R7 whose bits are set, and tells where the last one ends.
    fn load_from<B: Board>(&mut self, bus: &mut Bus<B>, start: u32, list: u32) -> Option<u32> {
        let (mut address, mut list) = (start, list);
        while list != 0 {
            let value = bus.read_word(address)?;
            self.set(list.trailing_zeros() as u8, value);
            address = address.wrapping_add(4);
            list &= list - 1;
        }
        Some(address)
    }
}
