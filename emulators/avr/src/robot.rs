//! An emulated Kilobot: core and board.

use bittybuzz_chips::atmega328p::{AvrBoard, Change, PAGE, RAM};
use bittybuzz_chips::{HardwareError, MemoryContent, ResetCause, Time};
use bittybuzz_kilobot::phase::Steps;
use bittybuzz_kilobot_board::{Edge, Kilobot, LightChange};
use bittybuzz_simavr::{AvrCore, AvrCoreState, DATA, DecodeStop, REGISTERS, SimavrChip, changed};

/// The additional cycles that a sleeping core needs to enter an interrupt (7.7.1 of the data
/// sheet).
const WAKE_UP: u64 = 4;

/// An emulated Kilobot.
pub struct EmulatedKilobot {
    pub core: AvrCore<Kilobot>,
    pub board: Kilobot,
    /// The cycle since which the core sleeps; `None` while it is awake.
    asleep: Option<u64>,
    /// The cycle since which an interrupt waits, if one does.
    waiting: Option<u64>,
    pub counted: Counted,
    /// The content of the chip's memory after a fall of the supply.
    pub memory: MemoryContent,
    /// The address in the data space at which the image stores the phase of its script.
    pub phase: Option<u16>,
    /// The state at the beginning of the window, for [`restore`](Self::restore).
    before: Box<Before>,
    /// Flash pages before their changes in this window, in the order of the changes.
    undo: Vec<(u16, [u8; PAGE as usize])>,
    pub is_dead: bool,
}

/// The counters since power-on.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Counted {
    /// Cycles in which the core slept.
    pub slept: u64,
    /// Interrupts served.
    pub interrupts: u64,
    /// Longest time that an interrupt had to wait.
    pub waited: Time,
    /// Resets by the watchdog.
    pub resets: u64,
    /// Counter of the script's steps.
    pub steps: Steps,
    /// Counter of the turns of the firmware's main loop.
    pub turns: Turns,
}

/// Counter of the turns of the firmware's main loop, each of which begins with `wdr`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Turns {
    /// Number of executions of `wdr`.
    begun: u64,
    /// Cycles without sleep at the beginning of the current turn.
    begin: u64,
    /// Cycles of the longest turn since the statistics were last requested, without sleep.
    pub longest: u64,
}

impl Turns {
    /// Updates the counters after `awake` cycles without sleep, when `wdr` was executed `begun`
    /// times.
    fn update(&mut self, begun: u64, awake: u64) {
        if self.begun == begun {
            return;
        }
        // The first `wdr` belongs to the start-up code.
        if self.begun > 1 && begun > self.begun {
            self.longest = self.longest.max(awake - self.begin);
        }
        (self.begun, self.begin) = (begun, awake);
    }
}

#[derive(Default)]
struct Before {
    core: AvrCoreState,
    board: Option<Kilobot>,
    asleep: Option<u64>,
    waiting: Option<u64>,
    counted: Counted,
    is_dead: bool,
}

impl EmulatedKilobot {
    /// Creates a robot with an erased flash.
    pub fn new(number: u16, chip: SimavrChip) -> Self {
        EmulatedKilobot {
            core: AvrCore::new(chip),
            board: Kilobot::new(number),
            asleep: None,
            waiting: None,
            counted: Counted::default(),
            memory: MemoryContent::Kept,
            phase: None,
            before: Box::default(),
            undo: Vec::new(),
            is_dead: false,
        }
    }

    /// Returns true if nothing happens until `time`, provided that the robot sees no light.
    pub fn is_quiet(&mut self, time: Time) -> bool {
        self.asleep.is_some() && self.board.next_event() >= self.board.cycle(time)
    }

    /// Saves the robot's state.
    pub fn save(&mut self) {
        self.undo.clear();
        let before = &mut *self.before;
        self.core.save(&mut before.core);
        before.board = Some(self.board.clone());
        (before.asleep, before.waiting) = (self.asleep, self.waiting);
        (before.counted, before.is_dead) = (self.counted, self.is_dead);
    }

    /// Restores the saved state.
    pub fn restore(&mut self) {
        while let Some((page, bytes)) = self.undo.pop() {
            self.core.write_flash(page.into(), &bytes);
        }
        let before = &*self.before;
        self.board = before.board.clone().expect("the state was saved at the turn's beginning");
        self.core.restore(&before.core);
        (self.asleep, self.waiting) = (before.asleep, before.waiting);
        (self.counted, self.is_dead) = (before.counted, before.is_dead);
    }

    /// Runs until `end`, with neighbors' light in `lights`. Returns the changes of the robot's own
    /// LED.
    pub fn run(&mut self, end: Time, lights: &[LightChange]) -> Vec<Edge> {
        self.board.will_see(lights.iter().copied());
        let mut until = self.board.cycle(end);
        while self.core.cycle() < until {
            self.step(until);
            // The program may have changed the oscillator's rate.
            until = self.board.cycle(end);
        }
        self.board.advance(self.core.cycle());
        self.board.take_edges()
    }

    fn step(&mut self, until: u64) {
        let now = self.core.cycle();
        self.board.advance(now);
        if self.board.is_expired() {
            self.reset();
            return;
        }
        let interrupt = self.board.interrupt();
        let is_served = self.core.interrupts_are_on() && !self.core.is_delayed();
        if let Some(since) = self.asleep {
            if interrupt.is_none() || !is_served {
                self.is_dead |= !self.core.interrupts_are_on();
                let next = self.board.next_event().min(until).max(now + 1);
                self.counted.slept += next - now;
                self.core.wait_until(next);
                return;
            }
            self.asleep = None;
            self.board.wake(now - since);
            self.core.wait_until(now + WAKE_UP);
        }
        if let Some(vector) = interrupt {
            let since = *self.waiting.get_or_insert(now);
            if is_served {
                let waited = self.board.time(now) - self.board.time(since);
                self.counted.waited = self.counted.waited.max(waited);
                self.waiting = None;
                self.counted.interrupts += 1;
                let address = self.board.acknowledge(vector);
                self.core.enter(address);
                return;
            }
        } else {
            self.waiting = None;
        }
        let next = self.board.next_event().min(until);
        let cycles = if self.core.is_delayed() { 1 } else { next.saturating_sub(now) };
        let pc = self.core.pc();
        match self.core.run(&mut self.board, cycles) {
            DecodeStop::Due => {}
            DecodeStop::Sleep => {
                self.board.advance(self.core.cycle());
                if self.board.sleep().is_some() {
                    self.asleep = Some(self.core.cycle());
                }
            }
            DecodeStop::Store(change) => self.store(&change),
            DecodeStop::Bad => self.board.fail(HardwareError::BadInstruction { after: pc }),
        }
        // The core stops at each `wdr`, which the firmware's main loop executes once per turn; at
        // most one phase begins in a turn.
        let awake = self.core.cycle() - self.counted.slept;
        self.counted.turns.update(self.board.watchdog_restarts(), awake);
        if let Some(phase) = self.phase {
            self.counted.steps.record(self.core.data()[usize::from(phase)]);
        }
        let pointer = self.core.stack_pointer();
        if pointer < RAM - 1 {
            self.board.fail(HardwareError::Stack { pointer });
        }
    }

    fn store(&mut self, change: &Change) {
        let (page, bytes) = changed(self.core.flash(), change);
        let start = usize::from(page);
        let mut old = [0; PAGE as usize];
        old.copy_from_slice(&self.core.flash()[start..start + usize::from(PAGE)]);
        self.undo.push((page, old));
        self.core.write_flash(start, &bytes);
    }

    fn reset(&mut self) {
        self.counted.resets += 1;
        self.begin(ResetCause::IndependentWatchdog);
    }

    /// Switches the power, or lets it fall for a moment, at `now`: the pins are released, and the
    /// program restarts.
    pub fn switch(&mut self, now: Time, cause: ResetCause) {
        let cycle = self.board.cycle(now);
        self.core.wait_until(cycle);
        self.board.advance(self.core.cycle());
        self.begin(cause);
        // The core's registers are as undefined as the RAM (7.4, 8.3).
        for part in [REGISTERS, RAM.into()..DATA] {
            let content = self.memory.content(part.len() as u32, &mut self.memory.noise());
            if let Some(content) = content {
                self.core.data()[part].copy_from_slice(&content);
            }
        }
        self.board.take_edges();
    }

    fn begin(&mut self, cause: ResetCause) {
        self.asleep = None;
        self.waiting = None;
        self.is_dead = false;
        self.board.reset(cause, self.memory);
        self.core.reset();
    }
}
