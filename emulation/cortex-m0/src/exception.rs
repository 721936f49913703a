//! Exception entry and return (ARMv6-M B1.5.6 to B1.5.8), and the handling of faults (B1.5.14).

use bittybuzz_chips::Board;
use bittybuzz_cortex_m::number::{HARD_FAULT, SV_CALL};

use crate::bus::Bus;
use crate::registers::{LR, PC, Processor, SP};

/// Cycles of an exception's entry (DDI 0432, 3.9) and return. The figure of the return is not
/// published and taken from a Cortex-M4.
const ENTRY_CYCLES: u64 = 16;
const EXIT_CYCLES: u64 = 10;
/// The size of a frame in bytes: r0 to r3, r12, lr, return address, xPSR.
const FRAME: u32 = 32;
/// Bit of a stacked xPSR: the frame was aligned by one word.
const XPSR_ALIGNED: u32 = 1 << 9;
const XPSR_T: u32 = 1 << 24;
const STACKED: [usize; 6] = [0, 1, 2, 3, 12, LR];

/// The error of a core that cannot continue: a fault where no fault may be taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lockup;

impl Processor {
    /// Takes `exception`, which returns to `return_to`: stacks the registers that the procedure
    /// call standard does not save, and enters the handler.
    pub fn enter<B: Board>(
        &mut self,
        bus: &mut Bus<B>,
        exception: u8,
        return_to: u32,
    ) -> Result<(), Lockup> {
        let thread = bus.nvic.current() == 0;
        let process_stack = thread && self.uses_process_stack;
        let stack = self.r[SP];
        let frame = (stack & !7).wrapping_sub(FRAME);
        let xpsr = self.xpsr(bus) & !XPSR_ALIGNED | (stack & 4) << 7;
        let mut words = [0; 8];
        for (word, register) in words.iter_mut().zip(STACKED) {
            *word = self.r[register];
        }
        words[6] = return_to;
        words[7] = xpsr;
        let mut is_stacked = true;
        for (index, word) in (0_u32..).zip(words) {
            is_stacked &= bus.write_word(frame.wrapping_add(4 * index), word).is_some();
        }
        self.r[SP] = frame;
        if process_stack {
            self.other_stack = std::mem::replace(&mut self.r[SP], self.other_stack);
            self.uses_process_stack = false;
        }
        // A frame that cannot be written is a fault, which replaces the exception. A HardFault is
        // entered nevertheless: its handler may first select another stack.
        let mut exception = exception;
        if !is_stacked {
            if bus.nvic.is_active(HARD_FAULT) {
                return Err(Lockup);
            }
            exception = HARD_FAULT;
        }
        let handler = bus.read_word(4 * u32::from(exception)).ok_or(Lockup)?;
        bus.nvic.activate(exception);
        bus.event = true;
        bus.cycles += ENTRY_CYCLES;
        self.exceptions += 1;
        self.r[LR] = match (thread, process_stack) {
            (false, _) => 0xffff_fff1,
            (true, false) => 0xffff_fff9,
            (true, true) => 0xffff_fffd,
        };
        self.r[PC] = handler & !1;
        if handler & 1 == 0 {
            return self.fault(bus, handler);
        }
        Ok(())
    }

    /// Returns from an exception, after a branch to `value`.
    pub fn leave<B: Board>(&mut self, bus: &mut Bus<B>, value: u32) -> Result<(), Lockup> {
        let exception = bus.nvic.current();
        let to_thread = value & 8 != 0;
        let is_valid = matches!(value, 0xffff_fff1 | 0xffff_fff9 | 0xffff_fffd);
        let last = bus.nvic.active_count() == 1;
        if exception == 0 || !is_valid {
            return self.fault(bus, value);
        }
        bus.nvic.deactivate(exception);
        if to_thread != last {
            return self.fault(bus, value);
        }
        if value & 4 != 0 {
            self.other_stack = std::mem::replace(&mut self.r[SP], self.other_stack);
            self.uses_process_stack = true;
        }
        let frame = self.r[SP];
        let mut words = [0; 8];
        for (index, word) in (0_u32..).zip(&mut words) {
            match bus.read_word(frame.wrapping_add(4 * index)) {
                Some(value) => *word = value,
                None => return self.fault(bus, value),
            }
        }
        for (word, register) in words.iter().zip(STACKED) {
            self.r[register] = *word;
        }
        let aligned = if words[7] & XPSR_ALIGNED != 0 { 4 } else { 0 };
        self.r[SP] = frame.wrapping_add(FRAME + aligned);
        self.set_flags(words[7]);
        self.r[PC] = words[6] & !1;
        bus.event = true;
        bus.cycles += EXIT_CYCLES;
        if words[7] & XPSR_T == 0 {
            return self.fault(bus, words[6]);
        }
        Ok(())
    }

    /// Takes the fault of the instruction at `at`.
    pub fn fault<B: Board>(&mut self, bus: &mut Bus<B>, at: u32) -> Result<(), Lockup> {
        if bus.nvic.is_active(HARD_FAULT) {
            return Err(Lockup);
        }
        self.enter(bus, HARD_FAULT, at)
    }

    /// Executes SVC. If its priority does not suffice, it causes a HardFault.
    pub fn call_supervisor<B: Board>(&mut self, bus: &mut Bus<B>, at: u32) -> Result<(), Lockup> {
        if bus.nvic.preempts(SV_CALL, self.masks()) {
            self.enter(bus, SV_CALL, at + 2)
        } else {
            self.fault(bus, at)
        }
    }
}
