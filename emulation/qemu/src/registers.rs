//! The core's registers.

/// The registers of the core.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CoreRegisters {
    /// R0 to R15.
    pub r: [u32; 16],
    /// Program status register.
    pub xpsr: u32,
}

impl CoreRegisters {
    /// Index of the stack pointer.
    pub const SP: u8 = 13;
    /// Index of the link register.
    pub const LR: u8 = 14;
    /// Index of the program counter.
    pub const PC: u8 = 15;

    /// Returns the stack pointer.
    pub fn sp(&self) -> u32 {
        self.r[usize::from(Self::SP)]
    }

    /// Returns the program counter.
    pub fn pc(&self) -> u32 {
        self.r[usize::from(Self::PC)]
    }

    /// Returns the number of the exception that is being handled; 0 for none.
    pub fn exception(&self) -> u32 {
        self.xpsr & 0x1ff
    }

    /// Advances past an instruction of `length` bytes, and through the IT block if the instruction
    /// is in one (ITAdvance() of the ARMv7-M manual, A7.3.2).
    pub fn skip_instruction(&mut self, length: u32) {
        self.r[usize::from(Self::PC)] = self.pc().wrapping_add(length);
        // ITSTATE bits 7 to 2 are XPSR bits 15 to 10, bits 1 and 0 are XPSR bits 26 and 25 (B1.4.2).
        let state = self.xpsr >> 8 & 0xfc | self.xpsr >> 25 & 0x03;
        let advanced = if state & 0x07 == 0 { 0 } else { state & 0xe0 | state << 1 & 0x1f };
        self.xpsr = self.xpsr & !0x0600_fc00 | (advanced & 0xfc) << 8 | (advanced & 0x03) << 25;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn skipping_advances_the_it_block() {
        // ITTE NE: firstcond 0001, mask 1010; the lower five bits move left, the last instruction ends it.
        let mut registers = CoreRegisters::default();
        let state = |xpsr: u32| xpsr >> 8 & 0xfc | xpsr >> 25 & 0x03;
        registers.xpsr = 0x6100_0000 | (0x1a & 0xfc) << 8 | (0x1a & 0x03) << 25;
        for (expected, pc) in [(0x14, 2), (0x08, 6), (0x00, 8)] {
            registers.skip_instruction(pc - registers.pc());
            assert_eq!((state(registers.xpsr), registers.pc()), (expected, pc));
            assert_eq!(registers.xpsr & !0x0600_fc00, 0x6100_0000);
        }
    }
}
