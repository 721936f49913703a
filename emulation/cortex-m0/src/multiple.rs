//! Loads and stores of several registers. A function returns none if there is no memory at the
//! address.

use bittybuzz_chips::Board;

use crate::bus::Bus;
use crate::decode::Op;
use crate::ram;
use crate::registers::{LR, Processor, Register, SP};

/// The bit of LR in the list of a push.
const LINK: u32 = 1 << 8;

/// Transfers whose words are all in RAM. Otherwise the functions return none and change nothing.
impl Processor {
    pub fn push_to_ram(&mut self, memory: &mut [u8], op: &Op) -> Option<()> {
        let start = self.r[SP].wrapping_sub(4 * op.more_cycles());
        let words = ram::words_mut(memory, start, op.more_cycles() as usize)?;
        let last = self.store_to(words, op.list() & !LINK);
        if let Some(word) = last {
            *word = self.r[LR].to_le_bytes();
        }
        self.r[SP] = start;
        Some(())
    }

    pub fn pop_from_ram(&mut self, memory: &[u8], op: &Op) -> Option<()> {
        let words = ram::words(memory, self.r[SP], op.more_cycles() as usize)?;
        self.load_all(words, op.list());
        self.r[SP] = self.r[SP].wrapping_add(4 * op.more_cycles());
        Some(())
    }

    /// Pops registers and returns the address of the next instruction. Returns none if the popped
    /// address needs more than a jump.
    pub fn pop_to_from_ram(&mut self, memory: &[u8], op: &Op) -> Option<u32> {
        // Two of the cycles belong to the jump.
        let count = op.more_cycles() - 2;
        let (last, words) = ram::words(memory, self.r[SP], count as usize)?.split_last()?;
        let to = u32::from_le_bytes(*last);
        if to & 1 == 0 || to >> 28 == 0xf {
            return None;
        }
        self.load_all(words, op.list());
        self.r[SP] = self.r[SP].wrapping_add(4 * count);
        Some(to & !1)
    }

    pub fn store_to_ram(&mut self, memory: &mut [u8], op: &Op) -> Option<()> {
        let start = self.get(op.b);
        self.store_to(ram::words_mut(memory, start, op.more_cycles() as usize)?, op.list());
        self.set(op.b, start.wrapping_add(4 * op.more_cycles()));
        Some(())
    }

    pub fn load_from_ram(&mut self, memory: &[u8], op: &Op) -> Option<()> {
        let start = self.get(op.b);
        self.load_all(ram::words(memory, start, op.more_cycles() as usize)?, op.list());
        // A base register that is in the list keeps its loaded value (A6.7.25).
        if op.list() >> (op.b as u8) & 1 == 0 {
            self.set(op.b, start.wrapping_add(4 * op.more_cycles()));
        }
        Some(())
    }

    /// Stores the registers of R0 to R7 in `list`; returns the word after them, if there is one.
    fn store_to<'w>(&self, words: &'w mut [[u8; 4]], list: u32) -> Option<&'w mut [u8; 4]> {
        let (mut words, mut list) = (words.iter_mut(), list);
        while list != 0 {
            *words.next()? = self.r[list.trailing_zeros() as usize & 7].to_le_bytes();
            list &= list - 1;
        }
        words.next()
    }

    /// Loads the registers of R0 to R7 in `list`.
    fn load_all(&mut self, words: &[[u8; 4]], list: u32) {
        let mut list = list;
        for word in words {
            self.r[list.trailing_zeros() as usize & 7] = u32::from_le_bytes(*word);
            list &= list.wrapping_sub(1);
        }
    }
}

impl Processor {
    /// Pushes the registers of R0 to R7 in `list`, and LR for bit 8.
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

    /// Pops registers and returns the address of the branch.
    pub fn pop_to<B: Board>(&mut self, bus: &mut Bus<B>, list: u32) -> Option<u32> {
        let end = self.load_from(bus, self.r[SP], list)?;
        let to = bus.read_word(end)?;
        self.r[SP] = end.wrapping_add(4);
        Some(to)
    }

    pub fn store_many<B: Board>(
        &mut self,
        bus: &mut Bus<B>,
        base: Register,
        list: u32,
    ) -> Option<()> {
        let end = self.store_from(bus, self.get(base), list)?;
        self.set(base, end);
        Some(())
    }

    pub fn load_many<B: Board>(
        &mut self,
        bus: &mut Bus<B>,
        base: Register,
        list: u32,
    ) -> Option<()> {
        let end = self.load_from(bus, self.get(base), list)?;
        // A base register that is in the list keeps its loaded value (A6.7.25).
        if list >> (base as u8) & 1 == 0 {
            self.set(base, end);
        }
        Some(())
    }

    /// Stores the registers of R0 to R7 in `list`, and returns the address after the last one.
    fn store_from<B: Board>(&self, bus: &mut Bus<B>, start: u32, list: u32) -> Option<u32> {
        let (mut address, mut list) = (start, list);
        while list != 0 {
            bus.write_word(address, self.r[list.trailing_zeros() as usize & 7])?;
            address = address.wrapping_add(4);
            list &= list - 1;
        }
        Some(address)
    }

    /// Loads the registers of R0 to R7 in `list`, and returns the address after the last one.
    fn load_from<B: Board>(&mut self, bus: &mut Bus<B>, start: u32, list: u32) -> Option<u32> {
        let (mut address, mut list) = (start, list);
        while list != 0 {
            let value = bus.read_word(address)?;
            self.r[list.trailing_zeros() as usize & 7] = value;
            address = address.wrapping_add(4);
            list &= list - 1;
        }
        Some(address)
    }
}
