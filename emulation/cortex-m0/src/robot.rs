//! The machine that a server drives.

use std::time::Duration;

use bittybuzz_chips::{Board, ResetCause, Time};
use bittybuzz_emulation::message::{CoreStatistics, Event, TimedEvent};
use bittybuzz_emulation::{Control, Image, Machine, MachineError, Pause};

use crate::bus::{Bus, FLASH, noise};
use crate::exception::Lockup;
use crate::execute::Stop;
use crate::nvic::Nvic;
use crate::registers::{Core, PC};

/// What the core does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Running,
    WaitingForEvent,
    WaitingForInterrupt,
    LockedUp,
}

/// A robot with its core.
pub struct Robot<B> {
    /// Which one, of several.
    number: usize,
    pub(crate) core: Core,
    pub(crate) bus: Bus<B>,
    state: State,
    /// By a debugger.
    halted: bool,
    events: Vec<TimedEvent>,
    systick_told: bool,
}

impl<B: Board> Robot<B> {
    /// Number `number` of several, which has no image yet.
    pub fn new(number: usize) -> Self {
        let mut robot = Robot {
            number,
            core: Core::new(0, 0),
            bus: Bus::new(number),
            state: State::Running,
            halted: false,
            events: Vec::new(),
            systick_told: false,
        };
        robot.start();
        robot
    }

    /// As the chip starts: stack pointer and first instruction stand at the beginning of the flash.
    pub(crate) fn start(&mut self) {
        let word = |address| {
            let bytes = self.bus.memory(address, 4).and_then(|bytes| bytes.first_chunk().copied());
            bytes.map_or(0, u32::from_le_bytes)
        };
        let (stack, first) = (word(FLASH), word(FLASH + 4));
        let counted = (self.core.instructions, self.core.exceptions);
        self.core = Core::new(stack, first);
        (self.core.instructions, self.core.exceptions) = counted;
        self.bus.nvic = Nvic::new();
        self.bus.event = false;
        self.bus.scr = 0;
        self.state = State::Running;
    }

    fn report(&mut self, event: Event) {
        let at = Duration::from_nanos(self.bus.now().nanos());
        self.events.push(TimedEvent { at, event });
    }

    fn reset(&mut self, cause: ResetCause) {
        self.report(Event::Reset { cause: cause.name().into() });
        self.bus.board.reset(cause);
        if cause == ResetCause::PowerOn {
            self.bus.ram = noise(B::MEMORY.ram);
        }
        for (address, bytes) in self.bus.board.start(FLASH).memory {
            self.bus.write_memory(address, &bytes);
        }
        let hz = self.bus.board.core_clock_hz();
        self.bus.clock.set_hz(hz, self.bus.cycles);
        self.start();
    }

    fn sleep(&mut self, until: Time) {
        let next = self.bus.board.next_event().map_or(until, |next| next.min(until));
        self.bus.clock.skip_to(next, self.bus.cycles);
    }

    /// Whether a sleeping core goes on.
    fn wakes(&mut self) -> bool {
        // PRIMASK does not keep WFI asleep (B1.5.17).
        let primask = self.core.primask && self.state == State::WaitingForEvent;
        if self.state == State::WaitingForEvent && std::mem::take(&mut self.bus.event) {
            return true;
        }
        self.bus.nvic.any_pending() && self.bus.nvic.next(primask).is_some()
    }

    fn settle(&mut self, outcome: Result<(), Lockup>) {
        if outcome == Err(Lockup) {
            let pc = self.core.r[PC];
            self.report(Event::Lockup { pc });
            self.state = State::LockedUp;
        }
    }

    fn step(&mut self, until: Time) {
        match self.state {
            _ if self.halted => self.sleep(until),
            State::LockedUp => self.sleep(until),
            State::WaitingForEvent | State::WaitingForInterrupt => {
                if self.wakes() {
                    self.state = State::Running;
                } else {
                    self.sleep(until);
                }
            }
            // Without a clock nothing runs; the watchdog has its own.
            State::Running if self.bus.clock.hz() == 0 => self.sleep(until),
            State::Running => {
                if self.bus.nvic.any_pending()
                    && let Some(exception) = self.bus.nvic.next(self.core.primask)
                {
                    let pc = self.core.r[PC];
                    let outcome = self.core.enter(&mut self.bus, exception, pc);
                    return self.settle(outcome);
                }
                let next = self.bus.board.next_event().map_or(until, |next| next.min(until));
                let deadline = self.bus.clock.cycle(next);
                self.bus.deadline = deadline.max(self.bus.cycles + 1);
                match self.core.run(&mut self.bus) {
                    Ok(Stop::Deadline) => {}
                    Ok(Stop::WaitForEvent) => self.state = State::WaitingForEvent,
                    Ok(Stop::WaitForInterrupt) => self.state = State::WaitingForInterrupt,
                    Err(lockup) => self.settle(Err(lockup)),
                }
            }
        }
    }

    fn move_data(&mut self) {
        while let Some(transfer) = self.bus.board.next_transfer() {
            self.bus.transfer(transfer);
        }
        if let Some(change) = self.bus.board.take_flash_change() {
            self.bus.change_flash(change);
        }
        self.bus.catch_up();
    }
}

impl<B: Control> Machine for Robot<B> {
    type Board = B;

    fn load(&mut self, image: &Image) -> Result<(), MachineError> {
        *self = Robot::new(self.number);
        for (address, bytes) in image.segments() {
            self.write_memory(address, bytes)?;
        }
        self.start();
        Ok(())
    }

    fn run(&mut self, until: Duration) -> Result<Pause, MachineError> {
        let until = Time::from_nanos(u64::try_from(until.as_nanos()).unwrap_or(u64::MAX));
        loop {
            self.bus.catch_up();
            if self.bus.board.wants_memory() {
                self.move_data();
            }
            let software = std::mem::take(&mut self.bus.reset_requested);
            let cause = self.bus.board.take_reset_request();
            if let Some(cause) = cause.or(software.then_some(ResetCause::Software)) {
                self.reset(cause);
            }
            if self.bus.systick_used && !std::mem::replace(&mut self.systick_told, true) {
                let text = "SysTick does not work in this emulator: use a timer of the chip".into();
                self.report(Event::HardwareError { text });
            }
            if self.bus.now() >= until {
                let locked_up = self.state == State::LockedUp && !self.bus.board.watchdog_runs();
                return Ok(if locked_up { Pause::Lockup } else { Pause::Time });
            }
            self.step(until);
        }
    }

    fn halt(&mut self, halted: bool) -> Result<(), MachineError> {
        self.halted = halted;
        self.bus.catch_up();
        self.bus.board.set_halted(halted);
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

    fn take_events(&mut self) -> Vec<TimedEvent> {
        let mut events = std::mem::take(&mut self.events);
        events.extend(self.bus.board.take_events().into_iter().map(|(at, event)| TimedEvent {
            at: Duration::from_nanos(at.nanos()),
            event: event.into(),
        }));
        events.sort_by_key(|event| event.at);
        events
    }

    fn statistics(&self) -> CoreStatistics {
        CoreStatistics {
            instructions: self.core.instructions,
            cycles: self.bus.cycles,
            exceptions: self.core.exceptions,
            longest_masked: Duration::ZERO,
            longest_turn: 0,
        }
    }

    fn board(&mut self) -> &mut B {
        &mut self.bus.board
    }

    fn quiet_until(&mut self) -> Duration {
        let bus = &self.bus;
        let sleeps = matches!(self.state, State::WaitingForEvent | State::WaitingForInterrupt)
            || self.halted
            || bus.clock.hz() == 0;
        if !sleeps || bus.event || bus.nvic.any_pending() || bus.board.wants_memory() {
            return Duration::ZERO;
        }
        Duration::from_nanos(bus.board.quiet_until().nanos())
    }
}
