//! The core's registers (ARMv6-M B1.4).

use bittybuzz_chips::Board;
use bittybuzz_cortex_m::Masks;

use crate::bus::Bus;

pub const SP: usize = 13;
pub const LR: usize = 14;
pub const PC: usize = 15;

/// The number of PRIMASK in MRS and MSR.
pub const PRIMASK: u32 = 16;

const N: u32 = 1 << 31;
const Z: u32 = 1 << 30;
const C: u32 = 1 << 29;
const V: u32 = 1 << 28;

/// A register as instructions encode it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Register {
    R0,
    R1,
    R2,
    R3,
    R4,
    R5,
    R6,
    R7,
    R8,
    R9,
    R10,
    R11,
    R12,
    Sp,
    Lr,
    Pc,
}

impl Register {
    const ALL: [Register; 16] = {
        use Register::*;
        [R0, R1, R2, R3, R4, R5, R6, R7, R8, R9, R10, R11, R12, Sp, Lr, Pc]
    };

    /// Returns the register for the four lowest bits of `number`.
    pub const fn of(number: u16) -> Self {
        Self::ALL[(number & 15) as usize]
    }
}

/// The core's registers.
pub struct Processor {
    /// R0 to R15. R13 is the stack pointer in use, R15 the address of the next instruction.
    pub r: [u32; 16],
    /// The flags N and Z as a value: N is its sign, and Z is set if it is 0. N and Z are never both
    /// set.
    pub nz: u32,
    pub c: bool,
    pub v: bool,
    pub primask: bool,
    /// CONTROL.SPSEL, for thread mode.
    pub uses_process_stack: bool,
    /// The stack pointer that is not in use.
    pub other_stack: u32,
    pub instructions: u64,
    pub exceptions: u64,
}

impl Processor {
    /// Returns the registers after a reset, with this stack pointer and first instruction.
    pub fn new(stack: u32, first: u32) -> Self {
        let mut r = [0; 16];
        (r[SP], r[LR], r[PC]) = (stack & !3, 0xffff_ffff, first & !1);
        Processor {
            r,
            nz: 1,
            c: false,
            v: false,
            primask: false,
            uses_process_stack: false,
            other_stack: 0,
            instructions: 0,
            exceptions: 0,
        }
    }

    /// Returns PRIMASK, the only mask that ARMv6-M has.
    pub fn masks(&self) -> Masks {
        Masks { primask: self.primask, ..Masks::default() }
    }

    pub fn xpsr<B: Board>(&self, bus: &Bus<B>) -> u32 {
        self.flags() | 1 << 24 | u32::from(bus.nvic.current())
    }

    fn flags(&self) -> u32 {
        [(self.nz >> 31 != 0, N), (self.nz == 0, Z), (self.c, C), (self.v, V)]
            .into_iter()
            .fold(0, |flags, (set, bit)| if set { flags | bit } else { flags })
    }

    pub fn set_flags(&mut self, psr: u32) {
        self.nz = if psr & Z != 0 { 0 } else { psr & N | 1 };
        self.c = psr & C != 0;
        self.v = psr & V != 0;
    }

    /// Returns a special register (B4.2): 0 to 3 are APSR and its combinations, 5 to 7 include
    /// IPSR; 8 MSP, 9 PSP, 16 PRIMASK, 20 CONTROL.
    pub fn special<B: Board>(&self, bus: &Bus<B>, number: u32) -> u32 {
        let exception = u32::from(bus.nvic.current());
        match number {
            0 | 2 => self.flags(),
            1 | 3 => self.flags() | exception,
            5 | 7 => exception,
            8 | 9 if (number == 9) == self.uses_process_stack => self.r[SP],
            8 | 9 => self.other_stack,
            PRIMASK => u32::from(self.primask),
            20 => u32::from(self.uses_process_stack) << 1,
            _ => 0,
        }
    }

    /// Sets PRIMASK. An interrupt that was masked is taken at once when PRIMASK is cleared.
    pub fn mask<B: Board>(&mut self, bus: &mut Bus<B>, is_masked: bool) {
        self.primask = is_masked;
        if !is_masked && bus.nvic.any_pending() {
            bus.deadline = 0;
        }
    }

    pub fn set_special<B: Board>(&mut self, bus: &mut Bus<B>, number: u32, value: u32) {
        match number {
            0..=3 => self.set_flags(value),
            8 | 9 if (number == 9) == self.uses_process_stack => self.r[SP] = value & !3,
            8 | 9 => self.other_stack = value & !3,
            PRIMASK => self.mask(bus, value & 1 != 0),
            // An exception always uses the main stack.
            20 if bus.nvic.current() == 0 && (value & 2 != 0) != self.uses_process_stack => {
                self.other_stack = std::mem::replace(&mut self.r[SP], self.other_stack);
                self.uses_process_stack = !self.uses_process_stack;
            }
            _ => {}
        }
    }
}
