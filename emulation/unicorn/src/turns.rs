//! The interface of the core to a robot: reset, execution, sleep.

use std::time::Duration;

use bittybuzz_chips::{Board, ResetCause, Time};
use bittybuzz_cortex_m::{Masks, Nvic};
use bittybuzz_emulation::message::{CoreStatistics, TimedEvent};
use bittybuzz_emulation::{Control, Core, CoreState, FirmwareImage, MachineError};
use unicorn_engine::RegisterARM as Register;

use crate::core::{UnicornCore, UnicornStop};
use crate::exception::Lockup;
use crate::private::PrivateRegisters;
use crate::systick::SysTick;

impl<B: Board> UnicornCore<'_, B> {
    /// Returns the state after an exception was taken, or after the core locked up instead.
    fn settle(
        &self,
        outcome: Result<(), Lockup>,
        state: CoreState,
    ) -> Result<CoreState, MachineError> {
        Ok(match outcome {
            Ok(()) => state,
            Err(Lockup) => CoreState::LockedUp { pc: self.register(Register::PC)? },
        })
    }
}

impl<B: Control> Core for UnicornCore<'_, B> {
    type Board = B;

    fn load(number: usize, image: &FirmwareImage) -> Result<Self, MachineError> {
        let mut core = UnicornCore::new(number)?;
        core.scramble()?;
        for (address, bytes) in image.segments() {
            core.write_bytes(address, bytes)?;
        }
        Ok(core)
    }

    fn restart(&mut self, vectors: u32, vector_table: u32) -> Result<(), MachineError> {
        self.copy_read_only()?;
        let system = self.system();
        system.nvic = Nvic::new(B::CORE);
        system.registers = PrivateRegisters::new();
        system.registers.vtor = vector_table;
        system.event = false;
        let (hz, cycles) = (system.board.core_clock_hz(), system.cycles);
        system.clock.set_hz(hz, cycles);
        system.observe_masks(Masks::default());
        system.systick = SysTick::new(hz);
        let now = system.now();
        system.systick.advance(now);
        self.reset_registers(vectors)
    }

    fn board(&self) -> &B {
        &self.uc.get_data().board
    }

    fn board_mut(&mut self) -> &mut B {
        &mut self.system().board
    }

    fn now(&self) -> Time {
        self.uc.get_data().now()
    }

    fn clock_hz(&self) -> u64 {
        self.uc.get_data().clock.hz()
    }

    fn catch_up(&mut self) {
        self.system().catch_up();
    }

    fn take_reset_request(&mut self) -> Option<ResetCause> {
        let system = self.system();
        let software = std::mem::take(&mut system.registers.reset_requested);
        system.board.take_reset_request().or(software.then_some(ResetCause::Software))
    }

    fn next_timer_event(&self) -> Option<Time> {
        self.uc.get_data().systick.next_event()
    }

    fn execute(&mut self, until: Time) -> Result<CoreState, MachineError> {
        if self.system().nvic.any_pending() {
            let masks = self.masks()?;
            if let Some(exception) = self.system().nvic.next(masks) {
                let outcome = self.enter(exception)?;
                return self.settle(outcome, CoreState::Running);
            }
        }
        let stop = self.emulate(until)?;
        let state = match stop {
            UnicornStop::WaitForEvent => CoreState::WaitingForEvent,
            UnicornStop::WaitForInterrupt => CoreState::WaitingForInterrupt,
            _ => CoreState::Running,
        };
        let outcome = self.raise(stop)?;
        let state = self.settle(outcome, state)?;
        let system = self.system();
        let exits = matches!(stop, UnicornStop::Return(_)) && system.nvic.current() == 0;
        if exits && system.registers.scr & PrivateRegisters::SCR_SLEEPONEXIT != 0 {
            return Ok(CoreState::WaitingForInterrupt);
        }
        Ok(state)
    }

    fn wakes(&mut self, state: CoreState) -> Result<bool, MachineError> {
        let mut masks = self.masks()?;
        if state == CoreState::WaitingForInterrupt {
            // PRIMASK does not keep WFI asleep (ARMv7-M B1.5.19).
            masks.primask = false;
        }
        let system = self.system();
        if state == CoreState::WaitingForEvent && std::mem::take(&mut system.event) {
            return Ok(true);
        }
        Ok(system.nvic.any_pending() && system.nvic.next(masks).is_some())
    }

    fn may_wake(&self) -> bool {
        let system = self.uc.get_data();
        system.event || system.nvic.any_pending()
    }

    fn sleep(&mut self, until: Time) -> Result<(), MachineError> {
        let system = self.system();
        let cycles = system.cycles;
        system.clock.skip_to(until, cycles);
        Ok(())
    }

    fn write_memory(&mut self, address: u32, bytes: &[u8]) -> Result<(), MachineError> {
        self.write_bytes(address, bytes)
    }

    fn read_memory(&mut self, address: u32, bytes: &mut [u8]) -> Result<(), MachineError> {
        self.read_bytes(address, bytes)
    }

    fn take_events(&mut self) -> Vec<TimedEvent> {
        std::mem::take(&mut self.system().events)
    }

    fn statistics(&self) -> CoreStatistics {
        let system = self.uc.get_data();
        CoreStatistics {
            instructions: system.instructions,
            cycles: system.cycles,
            exceptions: system.exceptions,
            longest_masked: Duration::from_nanos(system.longest_masked().nanos()),
            longest_turn: 0,
        }
    }
}
