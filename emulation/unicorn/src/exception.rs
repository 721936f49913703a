//! Exception entry and return (ARMv7-M B1.5.6 to B1.5.8), and the handling of faults (B1.5.14).

use bittybuzz_chips::CoreKind;
use bittybuzz_cortex_m::number;
use bittybuzz_emulation::{Control, MachineError};
use unicorn_engine::RegisterARM as Register;

use crate::core::{UnicornCore, UnicornStop, XPSR_T, failed};

/// Returns the smallest number of cycles from an interrupt to its handler: Cortex-M4 (ARM DDI 0439
/// 3.9.1), Cortex-M0 (ARM DDI 0432 3.9).
const fn entry_cycles(core: CoreKind) -> u64 {
    match core {
        CoreKind::CortexM0 => 16,
        CoreKind::CortexM4F => 12,
    }
}
/// Cycles of an exception return. The figure of the Cortex-M0 is not published and assumed to be
/// the same.
const EXIT_CYCLES: u64 = 10;

/// Words of a frame: r0 to r3, r12, lr, return address, xPSR.
const BASIC_FRAME: u32 = 8;
/// Words of a frame with s0 to s15, FPSCR and a reserved word.
const EXTENDED_FRAME: u32 = 26;
/// The double-precision registers that the extended frame holds.
const STACKED_DOUBLES: [Register; 8] = [
    Register::D0,
    Register::D1,
    Register::D2,
    Register::D3,
    Register::D4,
    Register::D5,
    Register::D6,
    Register::D7,
];
const STACKED: [Register; 6] =
    [Register::R0, Register::R1, Register::R2, Register::R3, Register::R12, Register::LR];

const CONTROL_SPSEL: u32 = 1 << 1;
const CONTROL_FPCA: u32 = 1 << 2;
/// Unicorn's Cortex-M33 has a second bit for the secure state, which always changes together with
/// the first.
const CONTROL_FP_BOTH: u32 = 1 << 3 | CONTROL_FPCA;
const XPSR_EXCEPTION: u32 = 0x1ff;
/// Bit of a stacked xPSR: the frame was aligned by one word.
const XPSR_ALIGNED: u32 = 1 << 9;
/// The if-then state, which an exception clears.
const XPSR_IT: u32 = 3 << 25 | 0x3f << 10;

const RETURN_BASIC: u32 = 1 << 4;
const RETURN_THREAD: u32 = 1 << 3;
const RETURN_PROCESS_STACK: u32 = 1 << 2;

const SHCSR_ENABLED: [(u8, u32); 3] =
    [(number::MEM_MANAGE, 1 << 16), (number::BUS_FAULT, 1 << 17), (number::USAGE_FAULT, 1 << 18)];
const HFSR_VECTTBL: u32 = 1 << 1;
const HFSR_FORCED: u32 = 1 << 30;
const HFSR_DEBUGEVT: u32 = 1 << 31;

/// Bits of CFSR.
mod cause {
    pub const IACCVIOL: u32 = 1 << 0;
    pub const IBUSERR: u32 = 1 << 8;
    pub const PRECISERR: u32 = 1 << 9;
    pub const UNSTKERR: u32 = 1 << 11;
    pub const STKERR: u32 = 1 << 12;
    pub const BFARVALID: u32 = 1 << 15;
    pub const UNDEFINSTR: u32 = 1 << 16;
    pub const INVSTATE: u32 = 1 << 17;
    pub const INVPC: u32 = 1 << 18;
    pub const NOCP: u32 = 1 << 19;
    pub const UNALIGNED: u32 = 1 << 24;
}

/// The error of a core that cannot continue: a fault where no fault may be taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lockup;

/// The result of an operation of the core: a lockup if the firmware caused it, an error if the
/// emulation failed.
type Outcome = Result<Result<(), Lockup>, MachineError>;

impl<B: Control> UnicornCore<'_, B> {
    /// Takes `exception`: stacks the registers that the procedure call standard does not save, and
    /// enters the handler.
    pub(crate) fn enter(&mut self, exception: u8) -> Outcome {
        let control = self.register(Register::CONTROL)?;
        let xpsr = self.register(Register::XPSR)?;
        let stack = self.register(Register::SP)?;
        let has_float = control & CONTROL_FPCA != 0;
        let words = if has_float { EXTENDED_FRAME } else { BASIC_FRAME };
        let aligned = stack & 4;
        let frame = (stack & !7).wrapping_sub(4 * words);

        let mut bytes = Vec::with_capacity(4 * words as usize);
        for register in STACKED {
            bytes.extend(self.register(register)?.to_le_bytes());
        }
        bytes.extend(self.register(Register::PC)?.to_le_bytes());
        bytes.extend((xpsr & !XPSR_ALIGNED | aligned << 7).to_le_bytes());
        if has_float {
            for register in STACKED_DOUBLES {
                bytes.extend(self.uc.reg_read(register).map_err(failed)?.to_le_bytes());
            }
            bytes.extend(self.register(Register::FPSCR)?.to_le_bytes());
            bytes.extend([0; 4]);
        }
        let stacked = B::MEMORY.is_ram(frame, bytes.len())
            && self.uc.mem_write(u64::from(frame), &bytes).is_ok();
        self.set_register(Register::SP, frame)?;

        let thread = xpsr & XPSR_EXCEPTION == 0;
        let process_stack = thread && control & CONTROL_SPSEL != 0;
        let mut value = 0xffff_ffe1;
        for (condition, bit) in [
            (!has_float, RETURN_BASIC),
            (thread, RETURN_THREAD),
            (process_stack, RETURN_PROCESS_STACK),
        ] {
            if condition {
                value |= bit;
            }
        }

        // A frame that cannot be written is a fault, which replaces the exception (B1.5.10). A
        // HardFault is entered nevertheless: its handler may first select another stack.
        let mut exception = exception;
        if !stacked {
            let system = self.system();
            system.registers.cfsr |= cause::STKERR;
            if exception == number::NMI || system.nvic.is_active(number::HARD_FAULT) {
                return Ok(Err(Lockup));
            }
            system.registers.hfsr |= HFSR_FORCED;
            exception = number::HARD_FAULT;
        }
        let vectors = self.system().registers.vtor;
        let handler = match self.read_word(vectors.wrapping_add(4 * u32::from(exception))) {
            Some(handler) => handler,
            None if exception <= number::HARD_FAULT => return Ok(Err(Lockup)),
            None => {
                self.system().registers.hfsr |= HFSR_VECTTBL;
                exception = number::HARD_FAULT;
                match self.read_word(vectors.wrapping_add(4 * u32::from(exception))) {
                    Some(handler) => handler,
                    None => return Ok(Err(Lockup)),
                }
            }
        };

        let system = self.system();
        system.nvic.activate(exception);
        system.event = true;
        system.exceptions += 1;
        system.cycles += entry_cycles(B::CORE);
        self.set_register(Register::LR, value)?;
        // The exception's number makes the core use the main stack.
        let cleared = xpsr & !(XPSR_EXCEPTION | XPSR_IT) | XPSR_T | u32::from(exception);
        self.set_register(Register::XPSR_NZCVQG, cleared)?;
        self.set_register(Register::CONTROL, control & !(CONTROL_SPSEL | CONTROL_FP_BOTH))?;
        self.set_register(Register::PC, handler | 1)?;
        if handler & 1 == 0 {
            return self.fault(number::USAGE_FAULT, cause::INVSTATE);
        }
        Ok(Ok(()))
    }

    /// Returns from an exception, after a branch to `value`.
    fn leave(&mut self, value: u32) -> Outcome {
        let xpsr = self.register(Register::XPSR)?;
        let exception = (xpsr & XPSR_EXCEPTION) as u8;
        let control = self.register(Register::CONTROL)?;
        let system = self.system();
        let valid = matches!(
            value,
            0xffff_ffe1 | 0xffff_ffe9 | 0xffff_ffed | 0xffff_fff1 | 0xffff_fff9 | 0xffff_fffd
        );
        let to_thread = value & RETURN_THREAD != 0;
        if exception == 0 || !valid || !system.nvic.is_active(exception) {
            return self.fault(number::USAGE_FAULT, cause::INVPC);
        }
        if to_thread != (system.nvic.active_count() == 1) {
            system.nvic.deactivate(exception);
            return self.fault(number::USAGE_FAULT, cause::INVPC);
        }
        system.nvic.deactivate(exception);
        if exception != number::NMI {
            self.set_register(Register::FAULTMASK, 0)?;
            self.system().masks_touched = true;
        }

        let stack = if value & RETURN_PROCESS_STACK != 0 { Register::PSP } else { Register::MSP };
        let frame = self.register(stack)?;
        let has_float = value & RETURN_BASIC == 0;
        let words = if has_float { EXTENDED_FRAME } else { BASIC_FRAME };
        let mut bytes = vec![0; 4 * words as usize];
        if !B::MEMORY.is_ram(frame, bytes.len()) {
            return self.fault(number::BUS_FAULT, cause::UNSTKERR);
        }
        self.uc.mem_read(u64::from(frame), &mut bytes).map_err(failed)?;
        let word = |index: usize| {
            let bytes = &bytes[4 * index..];
            u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])
        };
        for (index, register) in STACKED.into_iter().enumerate() {
            self.set_register(register, word(index))?;
        }
        let stacked = word(7);
        let aligned = if stacked & XPSR_ALIGNED != 0 { 4 } else { 0 };
        self.set_register(stack, frame.wrapping_add(4 * words + aligned))?;
        if has_float {
            for (index, register) in STACKED_DOUBLES.into_iter().enumerate() {
                let low = u64::from(word(8 + 2 * index));
                let high = u64::from(word(9 + 2 * index));
                self.uc.reg_write(register, low | high << 32).map_err(failed)?;
            }
            self.set_register(Register::FPSCR, word(24))?;
        }
        let mut control = control & !(CONTROL_SPSEL | CONTROL_FP_BOTH);
        if has_float {
            control |= CONTROL_FP_BOTH;
        }
        if to_thread && value & RETURN_PROCESS_STACK != 0 {
            control |= CONTROL_SPSEL;
        }
        self.set_register(Register::CONTROL, control)?;
        let outer = u32::from(self.system().nvic.current());
        let restored = stacked & !(XPSR_ALIGNED | XPSR_EXCEPTION) | outer;
        self.set_register(Register::XPSR_NZCVQG, restored)?;
        self.set_register(Register::PC, word(6) | 1)?;
        let system = self.system();
        system.event = true;
        system.cycles += EXIT_CYCLES;
        if stacked & XPSR_T == 0 {
            return self.fault(number::USAGE_FAULT, cause::INVSTATE);
        }
        Ok(Ok(()))
    }

    /// Handles the reason why the core stopped, if it is an exception of the core itself.
    pub(crate) fn raise(&mut self, stop: UnicornStop) -> Outcome {
        match stop {
            UnicornStop::Deadline | UnicornStop::WaitForEvent | UnicornStop::WaitForInterrupt => {
                Ok(Ok(()))
            }
            UnicornStop::FlashWrite => self.program_flash(),
            UnicornStop::Return(value) => self.leave(value),
            UnicornStop::SupervisorCall => self.synchronous(number::SV_CALL, 0),
            // Without a debugger, a breakpoint escalates to a HardFault (C1.6.1).
            UnicornStop::Breakpoint => {
                self.system().registers.hfsr |= HFSR_DEBUGEVT;
                self.synchronous(number::HARD_FAULT, 0)
            }
            UnicornStop::Undefined => self.fault(number::USAGE_FAULT, cause::UNDEFINSTR),
            UnicornStop::InvalidState => self.fault(number::USAGE_FAULT, cause::INVSTATE),
            UnicornStop::NoCoprocessor => self.fault(number::USAGE_FAULT, cause::NOCP),
            UnicornStop::Unaligned => self.fault(number::USAGE_FAULT, cause::UNALIGNED),
            UnicornStop::BadFetch => {
                // Nothing is executed from peripherals and beyond (B3.1).
                let pc = self.register(Register::PC)?;
                if pc >= 0x4000_0000 {
                    self.fault(number::MEM_MANAGE, cause::IACCVIOL)
                } else {
                    self.fault(number::BUS_FAULT, cause::IBUSERR)
                }
            }
            UnicornStop::BadAccess => {
                let system = self.system();
                system.registers.bfar = system.failed_address;
                self.fault(number::BUS_FAULT, cause::PRECISERR | cause::BFARVALID)
            }
        }
    }

    pub(crate) fn fault(&mut self, exception: u8, cause: u32) -> Outcome {
        let registers = &mut self.system().registers;
        registers.cfsr |= cause;
        let enabled = SHCSR_ENABLED
            .iter()
            .any(|(fault, bit)| *fault == exception && registers.shcsr & bit != 0);
        if enabled {
            return self.synchronous(exception, HFSR_FORCED);
        }
        registers.hfsr |= HFSR_FORCED;
        self.synchronous(number::HARD_FAULT, 0)
    }

    /// Takes an exception that cannot wait. If its priority does not suffice, it becomes a
    /// HardFault. If a HardFault cannot be taken either, the core locks up.
    fn synchronous(&mut self, exception: u8, escalated: u32) -> Outcome {
        let masks = self.masks()?;
        let system = self.system();
        if system.nvic.preempts(exception, masks) {
            return self.enter(exception);
        }
        system.registers.hfsr |=
            escalated | if exception == number::SV_CALL { HFSR_FORCED } else { 0 };
        if system.nvic.preempts(number::HARD_FAULT, masks) {
            return self.enter(number::HARD_FAULT);
        }
        Ok(Err(Lockup))
    }
}
