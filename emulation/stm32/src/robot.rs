//! The machine that the server drives.

use std::time::Duration;

use bittybuzz_chips::{Board, ResetCause, Time};
use bittybuzz_emulation::message::{CoreStatistics, Event, TimedEvent};
use bittybuzz_emulation::{Control, Image, Machine, MachineError, Pause};
use unicorn_engine::RegisterARM as Register;

use crate::core::{Core, FLASH, Stop};
use crate::exception::Lockup;
use crate::private::Registers;

/// What the core does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Running,
    WaitingForEvent,
    WaitingForInterrupt,
    LockedUp,
    /// Another program than the robot's runs, until the next reset.
    InLoader,
}

impl State {
    fn after_reset(program_starts: bool) -> Self {
        if program_starts { State::Running } else { State::InLoader }
    }
}

/// A robot with its core.
pub struct Robot<'a, B: Board + 'static> {
    /// Which one, of several.
    number: usize,
    core: Core<'a, B>,
    state: State,
    /// By a debugger.
    halted: bool,
    vectors: u32,
}

impl<B: Board> Robot<'_, B> {
    /// Number `number` of several, which has no image yet.
    pub fn new(number: usize) -> Result<Self, MachineError> {
        let core = Core::new(number)?;
        Ok(Robot { number, core, state: State::Running, halted: false, vectors: FLASH })
    }

    /// One that starts `flash`, which begins with its vectors, at address `vectors`.
    #[cfg(test)]
    pub fn with_flash(vectors: u32, flash: &[u8]) -> Result<Self, MachineError> {
        let mut core = Core::new(0)?;
        core.write_bytes(vectors, flash)?;
        let state = State::after_reset(core.reset(None, vectors)?);
        Ok(Robot { number: 0, core, state, halted: false, vectors })
    }

    fn reset(&mut self, cause: ResetCause) -> Result<(), MachineError> {
        self.core.system().report(Event::Reset { cause: cause.name().into() });
        self.state = State::after_reset(self.core.reset(Some(cause), self.vectors)?);
        Ok(())
    }

    /// Takes an exception, or finds that the core locks up.
    fn settle(&mut self, outcome: Result<(), Lockup>) -> Result<(), MachineError> {
        if outcome == Err(Lockup) {
            let pc = self.core.register(Register::PC)?;
            self.core.system().report(Event::Lockup { pc });
            self.state = State::LockedUp;
        }
        Ok(())
    }

    /// Lets the core sleep until something may wake it.
    fn sleep(&mut self, until: Time) {
        let system = self.core.system();
        let next = system.next_event().map_or(until, |next| next.min(until));
        let cycles = system.cycles;
        system.clock.skip_to(next, cycles);
    }

    /// Whether a sleeping core goes on.
    fn wakes(&mut self) -> Result<bool, MachineError> {
        let mut masks = self.core.masks()?;
        if self.state == State::WaitingForInterrupt {
            // PRIMASK does not keep WFI asleep (ARMv7-M B1.5.19).
            masks.primask = false;
        }
        let by_event = self.state == State::WaitingForEvent;
        let system = self.core.system();
        if by_event && std::mem::take(&mut system.event) {
            return Ok(true);
        }
        Ok(system.nvic.any_pending() && system.nvic.next(masks).is_some())
    }

    /// Does what the DMA controller and the flash interface want of the memory.
    fn move_data(&mut self) -> Result<(), MachineError> {
        while let Some(transfer) = self.core.system().board.next_transfer() {
            self.core.transfer(transfer)?;
        }
        if let Some(change) = self.core.system().board.take_flash_change() {
            self.core.change_flash(change)?;
        }
        self.core.system().catch_up();
        Ok(())
    }

    fn step(&mut self, until: Time) -> Result<(), MachineError> {
        match self.state {
            _ if self.halted => self.sleep(until),
            State::LockedUp | State::InLoader => self.sleep(until),
            State::WaitingForEvent | State::WaitingForInterrupt => {
                if self.wakes()? {
                    self.state = State::Running;
                } else {
                    self.sleep(until);
                }
            }
            // Without a clock nothing runs; the watchdog has its own.
            State::Running if self.core.system().clock.hz() == 0 => self.sleep(until),
            State::Running => {
                if self.core.system().nvic.any_pending() {
                    let masks = self.core.masks()?;
                    if let Some(exception) = self.core.system().nvic.next(masks) {
                        let outcome = self.core.enter(exception)?;
                        return self.settle(outcome);
                    }
                }
                let next = self.core.system().next_event();
                let deadline = next.map_or(until, |next| next.min(until));
                let stop = self.core.execute(deadline)?;
                match stop {
                    Stop::WaitForEvent => self.state = State::WaitingForEvent,
                    Stop::WaitForInterrupt => self.state = State::WaitingForInterrupt,
                    _ => {}
                }
                let outcome = self.core.raise(stop)?;
                self.settle(outcome)?;
                let system = self.core.system();
                let exits = matches!(stop, Stop::Return(_)) && system.nvic.current() == 0;
                if exits && system.registers.scr & Registers::SCR_SLEEPONEXIT != 0 {
                    self.state = State::WaitingForInterrupt;
                }
            }
        }
        Ok(())
    }
}

impl<B: Control> Machine for Robot<'_, B> {
    type Board = B;

    fn load(&mut self, image: &Image) -> Result<(), MachineError> {
        let number = self.number;
        let mut core = Core::new(number)?;
        for (address, bytes) in image.segments() {
            core.write_bytes(address, bytes)?;
        }
        let state = State::after_reset(core.reset(None, image.vectors())?);
        *self = Robot { number, core, state, halted: false, vectors: image.vectors() };
        Ok(())
    }

    fn run(&mut self, until: Duration) -> Result<Pause, MachineError> {
        let until = Time::from_nanos(u64::try_from(until.as_nanos()).unwrap_or(u64::MAX));
        loop {
            let system = self.core.system();
            system.catch_up();
            if system.board.wants_memory() {
                self.move_data()?;
            }
            let system = self.core.system();
            if !system.board.is_powered() {
                return Ok(Pause::PowerOff);
            }
            let software = std::mem::take(&mut system.registers.reset_requested);
            let cause = system.board.take_reset_request();
            if let Some(cause) = cause.or(software.then_some(ResetCause::Software)) {
                self.reset(cause)?;
            }
            let system = self.core.system();
            if system.now() >= until {
                let locked_up = self.state == State::LockedUp && !system.board.watchdog_runs();
                return Ok(if locked_up { Pause::Lockup } else { Pause::Time });
            }
            self.step(until)?;
        }
    }

    fn halt(&mut self, halted: bool) -> Result<(), MachineError> {
        self.halted = halted;
        let system = self.core.system();
        system.catch_up();
        system.board.set_halted(halted);
        Ok(())
    }

    fn write_memory(&mut self, address: u32, bytes: &[u8]) -> Result<(), MachineError> {
        self.core.write_bytes(address, bytes)
    }

    fn read_memory(&mut self, address: u32, bytes: &mut [u8]) -> Result<(), MachineError> {
        self.core.read_bytes(address, bytes)
    }

    fn take_events(&mut self) -> Vec<TimedEvent> {
        let system = self.core.system();
        let mut events = std::mem::take(&mut system.events);
        events.extend(system.board.take_events().into_iter().map(|(at, event)| TimedEvent {
            at: Duration::from_nanos(at.nanos()),
            event: event.into(),
        }));
        events.sort_by_key(|event| event.at);
        events
    }

    fn statistics(&self) -> CoreStatistics {
        let system = self.core.uc.get_data();
        CoreStatistics {
            instructions: system.instructions,
            cycles: system.cycles,
            exceptions: system.exceptions,
            longest_masked: Duration::from_nanos(system.longest_masked().nanos()),
            longest_turn: 0,
        }
    }

    fn board(&mut self) -> &mut B {
        &mut self.core.system().board
    }

    fn quiet_until(&mut self) -> Duration {
        let waits = matches!(self.state, State::WaitingForEvent | State::WaitingForInterrupt);
        let system = self.core.system();
        let sleeps = waits || system.clock.hz() == 0;
        // Something may have woken it since.
        if !sleeps || system.event || system.nvic.any_pending() || system.board.wants_memory() {
            return Duration::ZERO;
        }
        let quiet =
            system.systick.next_event().into_iter().chain([system.board.quiet_until()]).min();
        Duration::from_nanos(quiet.unwrap_or(Time::NEVER).nanos())
    }
}
