//! The state around the core's registers, which Unicorn's callbacks use.

use bittybuzz_chips::{Board, CoreClock, Time, Width};
use bittybuzz_cortex_m::{Masks, Nvic, number};
use bittybuzz_emulation::message::{EmulatorEvent, TimedEvent};

use crate::blocks::{Blocks, CodeBlock};
use crate::private::PrivateRegisters;
use crate::systick::SysTick;

/// Cycles between two checks of the masks while a masked interrupt waits, in case the core missed
/// the instruction that changed the masks.
const LOOK_AGAIN: u64 = 1_000;

/// The data that Unicorn's callbacks use.
pub struct System<B> {
    pub board: B,
    pub nvic: Nvic,
    pub systick: SysTick,
    pub registers: PrivateRegisters,
    pub clock: CoreClock,
    /// Cycles of the core's clock since power-on, without those asleep.
    pub cycles: u64,
    /// Instructions executed since power-on.
    pub instructions: u64,
    /// No block begins at or after this cycle.
    pub deadline: u64,
    /// The event register of WFE.
    pub event: bool,
    pub blocks: Blocks,
    /// The block that runs, and the address after it.
    pub block: CodeBlock,
    pub block_end: u32,
    /// True if the last block may have changed the masks, and they were not read since.
    pub masks_touched: bool,
    masked_since: Option<u64>,
    longest_masked: Time,
    /// The number by which Unicorn reports an exception, as defined by QEMU.
    pub interrupt: Option<u32>,
    /// The address of the last failed access, and the size and value that it was to write.
    pub failed_address: u32,
    pub failed_write: (usize, u32),
    /// True if the next block has an instruction that the architecture lacks.
    pub undefined: bool,
    /// True if execution stopped at the deadline.
    pub stopped: bool,
    pub events: Vec<TimedEvent>,
    /// Exceptions taken since power-on.
    pub exceptions: u64,
    mpu_noted: bool,
}

impl<B: Board> System<B> {
    /// Creates the system of robot `number` of several, at the moment of its power-on.
    pub fn new(number: usize) -> Self {
        let board = B::power_on(number);
        let hz = board.core_clock_hz();
        System {
            board,
            nvic: Nvic::new(B::CORE),
            systick: SysTick::new(hz),
            registers: PrivateRegisters::new(),
            clock: CoreClock::new(hz),
            cycles: 0,
            instructions: 0,
            deadline: 0,
            event: false,
            blocks: Blocks::new(),
            block: CodeBlock::default(),
            block_end: 0,
            masks_touched: false,
            masked_since: None,
            longest_masked: Time::ZERO,
            interrupt: None,
            failed_address: 0,
            failed_write: (0, 0),
            undefined: false,
            stopped: false,
            events: Vec::new(),
            exceptions: 0,
            mpu_noted: false,
        }
    }

    pub fn now(&self) -> Time {
        self.clock.time(self.cycles)
    }

    /// Advances the board and SysTick to the core's time, and passes their interrupts to the core.
    pub fn catch_up(&mut self) {
        self.board.advance(self.now());
        self.update_lines();
        self.advance_systick();
    }

    fn update_lines(&mut self) {
        let was_pending = self.nvic.any_pending();
        self.nvic.set_lines(self.board.interrupts().bits());
        let wakes = self.registers.scr & PrivateRegisters::SCR_SEVONPEND != 0;
        self.event |= wakes && !was_pending && self.nvic.any_pending();
    }

    pub fn advance_systick(&mut self) {
        let now = self.now();
        if self.systick.advance(now) {
            self.nvic.pend(number::SYS_TICK);
        }
    }

    pub fn next_event(&self) -> Option<Time> {
        self.board.next_event().into_iter().chain(self.systick.next_event()).min()
    }

    pub fn report(&mut self, event: EmulatorEvent) {
        let at = std::time::Duration::from_nanos(self.now().nanos());
        self.events.push(TimedEvent { at, event });
    }

    pub fn note_mpu(&mut self) {
        if !std::mem::replace(&mut self.mpu_noted, true) {
            let text = "the MPU is turned on, but this emulator protects no memory".into();
            self.report(EmulatorEvent::HardwareError { text });
        }
    }

    pub fn longest_masked(&self) -> Time {
        self.longest_masked
    }

    pub fn read(&mut self, address: u32, width: Width) -> u32 {
        self.catch_up();
        let value = self.board.read(address, width);
        self.after_access();
        value
    }

    pub fn write(&mut self, address: u32, width: Width, value: u32) {
        self.catch_up();
        self.board.write(address, width, value);
        self.after_access();
    }

    /// Updates the core after an access, which may have changed clocks, raised interrupts or moved
    /// the next event to an earlier time. The deadline then ends execution after the present block.
    pub fn after_access(&mut self) {
        self.update_lines();
        let hz = self.board.core_clock_hz();
        if hz != self.clock.hz() {
            self.clock.set_hz(hz, self.cycles);
            let now = self.now();
            if self.systick.set_core_hz(hz, now) {
                self.nvic.pend(number::SYS_TICK);
            }
            self.deadline = 0;
        }
        if self.nvic.any_pending() || self.registers.reset_requested || self.board.wants_memory() {
            self.deadline = 0;
        } else if let Some(next) = self.next_event() {
            self.deadline = self.deadline.min(self.clock.cycle(next));
        }
    }

    /// Prepares for execution up to time `until`.
    pub fn begin(&mut self, until: Time) {
        let cycle = self.clock.cycle(until).max(self.cycles + 1);
        let waits = self.nvic.any_pending();
        self.deadline = if waits { cycle.min(self.cycles + LOOK_AGAIN) } else { cycle };
        self.block = CodeBlock::default();
        self.interrupt = None;
        self.undefined = false;
        self.stopped = false;
    }

    /// Takes the present masks, and measures the longest time for which interrupts were masked.
    pub fn observe_masks(&mut self, masks: Masks) {
        match (masks.any(), self.masked_since) {
            (true, None) => self.masked_since = Some(self.cycles),
            (false, Some(since)) => {
                let span = Time::of_ticks(self.cycles - since, self.clock.hz());
                self.longest_masked = self.longest_masked.max(span);
                self.masked_since = None;
            }
            _ => {}
        }
    }
}
