//! Loads and stores of several registers.

use bittybuzz_chips::Board;

use crate::bus::Bus;
use crate::execute::{At, Outcome};
use crate::registers::{Core, LR, SP};

impl Core {
    pub fn push<B: Board>(&mut self, bus: &mut Bus<B>, at: &mut At, pc: u32, list: u32) -> Outcome {
        let count = list.count_ones();
        at.cycles += u64::from(count);
        bus.cycles = at.cycles;
        let start = self.r[SP].wrapping_sub(4 * count);
        let mut address = start;
        for register in (0..8).chain([LR]) {
            let bit = if register == LR { 8 } else { register };
            if list >> bit & 1 != 0 {
                if bus.write_word(address, self.r[register]).is_none() {
                    return self.refuse(bus, at, pc);
                }
                address = address.wrapping_add(4);
            }
        }
        self.r[SP] = start;
        Ok(None)
    }

    pub fn pop<B: Board>(
        &mut self,
        bus: &mut Bus<B>,
        at: &mut At,
        pc: u32,
        list: u32,
        to_pc: bool,
    ) -> Outcome {
        at.cycles += u64::from(list.count_ones());
        bus.cycles = at.cycles;
        let mut address = self.r[SP];
        for register in 0..8 {
            if list >> register & 1 != 0 {
                match bus.read_word(address) {
                    Some(value) => self.r[register] = value,
                    None => return self.refuse(bus, at, pc),
                }
                address = address.wrapping_add(4);
            }
        }
        if !to_pc {
            self.r[SP] = address;
            return Ok(None);
        }
        at.cycles += 3;
        match bus.read_word(address) {
            Some(to) => {
                self.r[SP] = address.wrapping_add(4);
                self.branch_exchange(bus, at, pc, to)
            }
            None => self.refuse(bus, at, pc),
        }
    }

    pub fn store_many<B: Board>(
        &mut self,
        bus: &mut Bus<B>,
        at: &mut At,
        pc: u32,
        b: u8,
        list: u32,
    ) -> Outcome {
        at.cycles += u64::from(list.count_ones());
        bus.cycles = at.cycles;
        let mut address = self.get(b);
        for register in 0..8 {
            if list >> register & 1 != 0 {
                if bus.write_word(address, self.r[register]).is_none() {
                    return self.refuse(bus, at, pc);
                }
                address = address.wrapping_add(4);
            }
        }
        self.set(b, address);
        Ok(None)
    }

    pub fn load_many<B: Board>(
        &mut self,
        bus: &mut Bus<B>,
        at: &mut At,
        pc: u32,
        b: u8,
        list: u32,
    ) -> Outcome {
        at.cycles += u64::from(list.count_ones());
        bus.cycles = at.cycles;
        let mut address = self.get(b);
        for register in 0..8 {
            if list >> register & 1 != 0 {
                match bus.read_word(address) {
                    Some(value) => self.r[register] = value,
                    None => return self.refuse(bus, at, pc),
                }
                address = address.wrapping_add(4);
            }
        }
        // A base that is loaded keeps what was loaded (A6.7.25).
        if list >> b & 1 == 0 {
            self.set(b, address);
        }
        Ok(None)
    }
}
