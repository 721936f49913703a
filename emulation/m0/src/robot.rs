//! The machine that the server drives.

use std::time::Duration;

use bittybuzz_chips::{Board, ResetCause, Time};
use bittybuzz_emulation::message::{CoreStatistics, Event, TimedEvent};
use bittybuzz_emulation::{Control, Image, Machine, MachineError, Pause};
use rp2040_emu::CortexM0Plus;

use crate::bus::{ChipBus, noise};
use crate::private::Private;

/// A robot with its core.
pub struct Robot<B> {
    /// Which one, of several.
    number: usize,
    core: CortexM0Plus,
    bus: ChipBus<B>,
    vectors: u32,
    instructions: u64,
    exceptions: u64,
    lockup_told: bool,
    events: Vec<TimedEvent>,
}

impl<B: Board> Robot<B> {
    /// Number `number` of several, which has no image yet.
    pub fn new(number: usize) -> Self {
        Robot {
            number,
            core: CortexM0Plus::new(),
            bus: ChipBus::new(number),
            vectors: 0,
            instructions: 0,
            exceptions: 0,
            lockup_told: false,
            events: Vec::new(),
        }
    }

    /// As the chip starts: stack pointer and first instruction stand at the beginning of the flash.
    fn start(&mut self) {
        self.core = CortexM0Plus::new();
        let word = |bus: &mut ChipBus<B>, address| {
            let bytes = bus.memory(address, 4).and_then(|bytes| bytes.first_chunk().copied());
            bytes.map_or(0, u32::from_le_bytes)
        };
        let stack = word(&mut self.bus, self.vectors) & !3;
        let first = word(&mut self.bus, self.vectors.wrapping_add(4));
        self.core.regs.msp = stack;
        self.core.set_reg(13, stack);
        self.core.set_reg(14, 0xffff_ffff);
        self.core.set_reg(15, first & !1);
        self.bus.private = Private::new();
        self.bus.active = 0;
        self.bus.event = false;
        self.bus.waits = false;
        self.bus.touched = true;
        self.lockup_told = false;
    }

    fn report(&mut self, event: Event) {
        let at = Duration::from_nanos(self.bus.clock.time(self.bus.cycles).nanos());
        self.events.push(TimedEvent { at, event });
    }

    fn reset(&mut self, cause: ResetCause) {
        self.report(Event::Reset { cause: cause.name().into() });
        self.bus.board.reset(cause);
        if cause == ResetCause::PowerOn {
            self.bus.ram = noise(B::MEMORY.ram);
        }
        for (address, bytes) in self.bus.board.start(self.vectors).memory {
            if let Some(memory) = self.bus.memory(address, bytes.len()) {
                memory.copy_from_slice(&bytes);
            }
        }
        let hz = self.bus.board.core_clock_hz();
        self.bus.clock.set_hz(hz, self.bus.cycles);
        self.start();
    }

    /// Executes until something has happened or the time is reached.
    fn execute(&mut self, deadline: u64) {
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

    /// Whether a core that waits goes on.
    fn wakes(&mut self) -> bool {
        let interrupt = self.bus.any_pending() && self.core.regs.primask & 1 == 0;
        std::mem::take(&mut self.bus.event) || interrupt
    }

    fn sleep(&mut self, until: Time) {
        let next = self.bus.board.next_event().map_or(until, |next| next.min(until));
        self.bus.clock.skip_to(next, self.bus.cycles);
    }
}

impl<B: Control> Machine for Robot<B> {
    type Board = B;

    fn load(&mut self, image: &Image) -> Result<(), MachineError> {
        *self = Robot::new(self.number);
        for (address, bytes) in image.segments() {
            self.write_memory(address, bytes)?;
        }
        self.vectors = image.vectors();
        self.start();
        Ok(())
    }

    fn run(&mut self, until: Duration) -> Result<Pause, MachineError> {
        let until = Time::from_nanos(u64::try_from(until.as_nanos()).unwrap_or(u64::MAX));
        loop {
            self.bus.catch_up();
            if self.bus.board.wants_memory() {
                while let Some(transfer) = self.bus.board.next_transfer() {
                    self.bus.transfer(transfer);
                }
                if let Some(change) = self.bus.board.take_flash_change() {
                    self.bus.change_flash(change);
                }
                self.bus.catch_up();
            }
            let software = std::mem::take(&mut self.bus.private.reset_requested);
            let cause = self.bus.board.take_reset_request();
            if let Some(cause) = cause.or(software.then_some(ResetCause::Software)) {
                self.reset(cause);
            }
            if self.bus.clock.time(self.bus.cycles) >= until {
                let locked_up = self.core.is_halted() && !self.bus.board.watchdog_runs();
                return Ok(if locked_up { Pause::Lockup } else { Pause::Time });
            }
            if self.core.is_halted() {
                if !std::mem::replace(&mut self.lockup_told, true) {
                    let pc = self.core.reg(15);
                    self.report(Event::Lockup { pc });
                }
                self.sleep(until);
            } else if self.bus.waits {
                if self.wakes() {
                    self.bus.waits = false;
                } else {
                    self.sleep(until);
                }
            } else if self.bus.clock.hz() == 0 {
                self.sleep(until);
            } else {
                let next = self.bus.board.next_event().map_or(until, |next| next.min(until));
                let deadline = self.bus.clock.cycle(next).max(self.bus.cycles + 1);
                self.execute(deadline);
            }
        }
    }

    fn write_memory(&mut self, address: u32, bytes: &[u8]) -> Result<(), MachineError> {
        let no_memory = MachineError::NoMemory { address, length: bytes.len() };
        self.bus.memory(address, bytes.len()).ok_or(no_memory)?.copy_from_slice(bytes);
        // The core remembers what it has decoded, but not of the flash where the STM32 has it.
        self.core.invalidate_decode_cache_all();
        Ok(())
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
            instructions: self.instructions,
            cycles: self.bus.cycles,
            exceptions: self.exceptions,
            longest_masked: Duration::ZERO,
            longest_turn: 0,
        }
    }

    fn board(&mut self) -> &mut B {
        &mut self.bus.board
    }

    fn quiet_until(&mut self) -> Duration {
        if !(self.bus.waits || self.bus.clock.hz() == 0)
            || self.bus.event
            || self.bus.any_pending()
            || self.bus.board.wants_memory()
        {
            return Duration::ZERO;
        }
        Duration::from_nanos(self.bus.board.quiet_until().nanos())
    }
}
