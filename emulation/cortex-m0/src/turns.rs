//! The interface of the core to a robot: reset, execution, sleep.

use std::time::Duration;

use bittybuzz_chips::{Board, CoreKind, FlashChange, ResetCause, Time};
use bittybuzz_cortex_m::{Masks, Nvic};
use bittybuzz_emulation::message::{CoreStatistics, EmulatorEvent, TimedEvent};
use bittybuzz_emulation::{Control, Core, CoreState, FirmwareImage, MachineError};

use crate::bus::{Bus, FLASH};
use crate::exception::Lockup;
use crate::execute::CoreStop;
use crate::registers::{PC, Processor};

/// A Cortex-M0 with its memory and its board.
pub struct CortexM0<B> {
    pub(crate) processor: Processor,
    pub(crate) bus: Bus<B>,
    systick_reported: bool,
    events: Vec<TimedEvent>,
}

impl<B: Board> CortexM0<B> {
    /// Creates the core of robot `number` of several, with erased flash.
    pub(crate) fn new(number: usize) -> Self {
        let (processor, bus) = (Processor::new(0, 0), Bus::new(number));
        CortexM0 { processor, bus, systick_reported: false, events: Vec::new() }
    }

    /// Starts as the chip does, with the stack pointer and first instruction from the beginning of
    /// the flash.
    fn start(&mut self) {
        let word = |address| {
            let bytes = self.bus.memory(address, 4).and_then(|bytes| bytes.first_chunk().copied());
            bytes.map_or(0, u32::from_le_bytes)
        };
        let (stack, first) = (word(FLASH), word(FLASH + 4));
        let counted = (self.processor.instructions, self.processor.exceptions);
        self.processor = Processor::new(stack, first);
        (self.processor.instructions, self.processor.exceptions) = counted;
        self.bus.nvic = Nvic::new(CoreKind::CortexM0);
        self.bus.event = false;
        self.bus.scr = 0;
    }

    /// Returns the state after an exception was taken, or after the core locked up instead.
    fn settle(&self, outcome: Result<(), Lockup>) -> CoreState {
        match outcome {
            Ok(()) => CoreState::Running,
            Err(Lockup) => CoreState::LockedUp { pc: self.processor.r[PC] },
        }
    }
}

impl<B: Control> Core for CortexM0<B> {
    type Board = B;

    fn load(number: usize, image: &FirmwareImage) -> Result<Self, MachineError> {
        let mut core = CortexM0::new(number);
        core.scramble()?;
        for (address, bytes) in image.segments() {
            core.write_memory(address, bytes)?;
        }
        Ok(core)
    }

    /// Restarts the core. The arguments are ignored, because the vectors are always at the
    /// beginning of the flash.
    fn restart(&mut self, _vectors: u32, _vector_table: u32) -> Result<(), MachineError> {
        let hz = self.bus.board.core_clock_hz();
        self.bus.clock.set_hz(hz, self.bus.cycles);
        self.start();
        Ok(())
    }

    fn board(&self) -> &B {
        &self.bus.board
    }

    fn board_mut(&mut self) -> &mut B {
        &mut self.bus.board
    }

    fn now(&self) -> Time {
        self.bus.now()
    }

    fn clock_hz(&self) -> u64 {
        self.bus.clock.hz()
    }

    fn catch_up(&mut self) {
        self.bus.catch_up();
        if self.bus.systick_used && !std::mem::replace(&mut self.systick_reported, true) {
            let text = "SysTick does not work in this emulator: use a timer of the chip".into();
            let at = Duration::from_nanos(self.now().nanos());
            self.events.push(TimedEvent { at, event: EmulatorEvent::HardwareError { text } });
        }
    }

    fn take_reset_request(&mut self) -> Option<ResetCause> {
        let software = std::mem::take(&mut self.bus.reset_requested);
        self.bus.board.take_reset_request().or(software.then_some(ResetCause::Software))
    }

    fn execute(&mut self, until: Time) -> Result<CoreState, MachineError> {
        if self.bus.nvic.any_pending()
            && let Some(exception) = self.bus.nvic.next(self.processor.masks())
        {
            let pc = self.processor.r[PC];
            let outcome = self.processor.enter(&mut self.bus, exception, pc);
            return Ok(self.settle(outcome));
        }
        self.bus.deadline = self.bus.clock.cycle(until).max(self.bus.cycles + 1);
        Ok(match self.processor.run(&mut self.bus) {
            Ok(CoreStop::Deadline) => CoreState::Running,
            Ok(CoreStop::WaitForEvent) => CoreState::WaitingForEvent,
            Ok(CoreStop::WaitForInterrupt) => CoreState::WaitingForInterrupt,
            Err(lockup) => self.settle(Err(lockup)),
        })
    }

    fn wakes(&mut self, state: CoreState) -> Result<bool, MachineError> {
        let is_for_event = state == CoreState::WaitingForEvent;
        if is_for_event && std::mem::take(&mut self.bus.event) {
            return Ok(true);
        }
        // PRIMASK does not keep WFI asleep (B1.5.17).
        let masks = if is_for_event { self.processor.masks() } else { Masks::default() };
        Ok(self.bus.nvic.any_pending() && self.bus.nvic.next(masks).is_some())
    }

    fn may_wake(&self) -> bool {
        self.bus.event || self.bus.nvic.any_pending()
    }

    fn sleep(&mut self, until: Time) -> Result<(), MachineError> {
        self.bus.clock.skip_to(until, self.bus.cycles);
        Ok(())
    }

    fn write_memory(&mut self, address: u32, bytes: &[u8]) -> Result<(), MachineError> {
        let no_memory = MachineError::NoMemory { address, length: bytes.len() };
        self.bus.write_memory(address, bytes).ok_or(no_memory)
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

    fn take_events(&mut self) -> Vec<TimedEvent> {
        std::mem::take(&mut self.events)
    }

    fn statistics(&self) -> CoreStatistics {
        CoreStatistics {
            instructions: self.processor.instructions,
            cycles: self.bus.cycles,
            exceptions: self.processor.exceptions,
            longest_masked: Duration::ZERO,
            longest_turn: 0,
        }
    }
}
