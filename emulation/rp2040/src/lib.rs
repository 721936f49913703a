//! The Cortex-M0+ of `rp2040-emu` as a core for the boards of robots, [`Rp2040Core`], which serves
//! as a second opinion.
//!
//! # What it will not do
//! * It has no SysTick, whose registers read 0.
//! * It does not nest interrupts: an interrupt waits until the current handler has returned,
//!   independently of priorities. Interrupts 26 to 31 are missing: USART1 and USART2, which no
//!   robot uses.
//!
//! The emulation was not compared with hardware.

mod bus;
mod private;

use std::time::Duration;

use bittybuzz_chips::{Board, FlashChange, ResetCause, Time};
use bittybuzz_emulation::message::CoreStatistics;
use bittybuzz_emulation::{Control, Core, CoreState, FirmwareImage, MachineError};
use rp2040_emu::CortexM0Plus;

use crate::bus::ChipBus;
use crate::private::Private;

/// A Cortex-M0+ with its memory and its board.
pub struct Rp2040Core<B> {
    core: CortexM0Plus,
    bus: ChipBus<B>,
    instructions: u64,
    exceptions: u64,
}

impl<B: Board> Rp2040Core<B> {
    /// Starts the program as the chip does, with the stack pointer and the entry point from its
    /// vector table.
    fn start(&mut self, vectors: u32) {
        self.core = CortexM0Plus::new();
        let word = |bus: &mut ChipBus<B>, address| {
            let bytes = bus.memory(address, 4).and_then(|bytes| bytes.first_chunk().copied());
            bytes.map_or(0, u32::from_le_bytes)
        };
        let stack = word(&mut self.bus, vectors) & !3;
        let first = word(&mut self.bus, vectors.wrapping_add(4));
        self.core.regs.msp = stack;
        self.core.set_reg(13, stack);
        self.core.set_reg(14, 0xffff_ffff);
        self.core.set_reg(15, first & !1);
        self.bus.private = Private::new();
        self.bus.active = 0;
        self.bus.event = false;
        self.bus.waits = false;
        self.bus.touched = true;
    }

    /// Executes instructions until the cycle `deadline` is reached, or until something happens that
    /// the caller must handle.
    fn run(&mut self, deadline: u64) {
        self.bus.touched = false;
        while self.bus.cycles < deadline && !self.bus.touched && !self.bus.waits {
            let cycles = self.core.step(&mut self.bus);
            self.bus.cycles += u64::from(cycles);
            self.instructions += 1;
            let active = self.core.regs.xpsr & 0x1ff;
            if active != self.bus.active {
                // Entering and leaving an exception sets the event register (ARMv6-M B1.5.18).
                self.bus.event = true;
                self.bus.active = active;
                self.exceptions += u64::from(active != 0);
                self.bus.catch_up();
                return;
            }
            if self.core.is_halted() {
                return;
            }
        }
    }
}

impl<B: Control> Core for Rp2040Core<B> {
    type Board = B;

    fn load(number: usize, image: &FirmwareImage) -> Result<Self, MachineError> {
        let (core, bus) = (CortexM0Plus::new(), ChipBus::new(number));
        let mut core = Rp2040Core { core, bus, instructions: 0, exceptions: 0 };
        core.scramble()?;
        for (address, bytes) in image.segments() {
            core.write_memory(address, bytes)?;
        }
        Ok(core)
    }

    fn restart(&mut self, vectors: u32, _vector_table: u32) -> Result<(), MachineError> {
        let hz = self.bus.board.core_clock_hz();
        self.bus.clock.set_hz(hz, self.bus.cycles);
        self.start(vectors);
        Ok(())
    }

    fn board(&self) -> &B {
        &self.bus.board
    }

    fn board_mut(&mut self) -> &mut B {
        &mut self.bus.board
    }

    fn now(&self) -> Time {
        self.bus.clock.time(self.bus.cycles)
    }

    fn clock_hz(&self) -> u64 {
        self.bus.clock.hz()
    }

    fn catch_up(&mut self) {
        self.bus.catch_up();
    }

    fn take_reset_request(&mut self) -> Option<ResetCause> {
        let software = std::mem::take(&mut self.bus.private.reset_requested);
        self.bus.board.take_reset_request().or(software.then_some(ResetCause::Software))
    }

    fn execute(&mut self, until: Time) -> Result<CoreState, MachineError> {
        if std::mem::take(&mut self.bus.flash_has_changed) {
            self.core.invalidate_decode_cache_all();
        }
        let deadline = self.bus.clock.cycle(until).max(self.bus.cycles + 1);
        self.run(deadline);
        let waits = std::mem::take(&mut self.bus.waits);
        Ok(if self.core.is_halted() {
            CoreState::LockedUp { pc: self.core.reg(15) }
        } else if waits {
            CoreState::WaitingForEvent
        } else {
            CoreState::Running
        })
    }

    /// Returns true if the core wakes. This core treats waits for events and waits for interrupts
    /// alike.
    fn wakes(&mut self, _: CoreState) -> Result<bool, MachineError> {
        let interrupt = self.bus.any_pending() && self.core.regs.primask & 1 == 0;
        Ok(std::mem::take(&mut self.bus.event) || interrupt)
    }

    fn may_wake(&self) -> bool {
        self.bus.event || self.bus.any_pending()
    }

    fn sleep(&mut self, until: Time) -> Result<(), MachineError> {
        self.bus.clock.skip_to(until, self.bus.cycles);
        Ok(())
    }

    fn write_memory(&mut self, address: u32, bytes: &[u8]) -> Result<(), MachineError> {
        let no_memory = MachineError::NoMemory { address, length: bytes.len() };
        self.bus.memory(address, bytes.len()).ok_or(no_memory)?.copy_from_slice(bytes);
        self.bus.flash_has_changed = true;
        Ok(())
    }

    fn read_memory(&mut self, address: u32, bytes: &mut [u8]) -> Result<(), MachineError> {
        let no_memory = MachineError::NoMemory { address, length: bytes.len() };
        bytes.copy_from_slice(self.bus.memory(address, bytes.len()).ok_or(no_memory)?);
        Ok(())
    }

    fn change_flash(&mut self, change: FlashChange) -> Result<(), MachineError> {
        self.bus.change_flash(change);
        Ok(())
    }

    fn statistics(&self) -> CoreStatistics {
        CoreStatistics {
            instructions: self.instructions,
            cycles: self.bus.cycles,
            exceptions: self.exceptions,
            longest_masked: Duration::ZERO,
            longest_turn: 0,
        }
    }
}
