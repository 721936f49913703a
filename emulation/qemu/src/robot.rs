//! Core and board together: who waits for whom.

use std::collections::{HashMap, HashSet};
use std::time::Duration;

use bittybuzz_chips::{Board, CoreKind, ResetCause, Time};
use bittybuzz_emulation::Pause;
use bittybuzz_emulation::message::{CoreStatistics, Event, TimedEvent};

use crate::access::{self, AccessError, Outcome};
use crate::core::{Cause, Core, CoreError, Machine};
use crate::memory::{self, Layout};
use crate::registers::Registers;
use crate::sites::{self, Action, Site};

/// A robot that runs an image.
pub struct Robot {
    core: Core,
    machine: Machine,
    flash: Vec<u8>,
    vectors: u32,
    sites: HashMap<u32, Site>,
    skipped: HashSet<u32>,
    state: State,
    /// The event register (B1.5.18).
    event: bool,
    systick_reported: bool,
    events: Vec<TimedEvent>,
    statistics: CoreStatistics,
}

/// What a firmware hears that uses SysTick.
const SYSTICK_USED: &str = "SysTick does not work in this emulator, QEMU's is used to stop the core: \
     use a timer of the chip, or bbz-emulate-stm32";

/// What the core does.
#[derive(Clone, Copy, PartialEq, Eq)]
enum State {
    Running,
    /// It waits for an exception (and for an event, but none comes from outside).
    Waiting,
    /// It is locked up (B1.5.15).
    LockedUp,
    /// Another program than the robot's runs, until the next reset.
    InLoader,
}

/// Why the emulation cannot go on.
#[derive(Debug, thiserror::Error)]
pub enum RobotError {
    /// The core failed.
    #[error(transparent)]
    Core(#[from] CoreError),
    /// QEMU ended by itself.
    #[error("qemu-system-arm ended: {0}")]
    Ended(String),
    /// The core wants what the bridge cannot do.
    #[error(transparent)]
    Access(#[from] AccessError),
    /// The core stopped where nothing stops it.
    #[error("QEMU stopped at {pc:#010x} for no reason")]
    Unexpected {
        /// Where.
        pc: u32,
    },
}

impl Robot {
    /// A robot with `flash`, just turned on. The bootloader starts what `vectors` says.
    pub fn new(
        core: CoreKind,
        board: &mut impl Board,
        flash: Vec<u8>,
        vectors: u32,
    ) -> Result<Self, RobotError> {
        let machine = Machine::with(core);
        let sites = sites::find(memory::FLASH.start, &flash).collect();
        let skipped = HashSet::new();
        let mut robot = Robot {
            core: start_core(machine, &flash, &sites, &skipped)?,
            machine,
            flash,
            vectors,
            sites,
            skipped,
            state: State::Running,
            event: false,
            systick_reported: false,
            events: Vec::new(),
            statistics: CoreStatistics::default(),
        };
        robot.start(board)?;
        Ok(robot)
    }

    /// Runs until `until`, or until nothing can happen any more.
    pub fn run(&mut self, board: &mut impl Board, until: Duration) -> Result<Pause, RobotError> {
        let until = Time::from_nanos(u64::try_from(until.as_nanos()).unwrap_or(u64::MAX));
        while board.now() < until {
            if let Some(cause) = board.take_reset_request() {
                self.reset(board, cause)?;
            }
            if !board.is_powered() {
                return Ok(Pause::PowerOff);
            }
            match self.state {
                // Without a clock nothing runs; the watchdog has its own.
                State::Running if board.core_clock_hz() == 0 => {
                    self.pass(board, until)?;
                }
                State::Running => self.execute(board, until)?,
                State::Waiting => self.wait(board, until)?,
                State::LockedUp if board.next_event().is_none() => return Ok(Pause::Lockup),
                State::LockedUp | State::InLoader => {
                    self.pass(board, next_event(board, until))?;
                }
            }
        }
        Ok(Pause::Time)
    }

    /// Reads memory as a debugger does; `false` if there is none.
    pub fn read_memory(&mut self, address: u32, bytes: &mut [u8]) -> Result<bool, RobotError> {
        match self.core.layout().locate(address, bytes.len()) {
            Some(place) => Ok(self.core.read_memory(place, bytes)?),
            None => Ok(false),
        }
    }

    /// Writes memory as a debugger does; `false` if there is none.
    pub fn write_memory(&mut self, address: u32, bytes: &[u8]) -> Result<bool, RobotError> {
        let Some(place) = self.core.layout().locate(address, bytes.len()) else {
            return Ok(false);
        };
        if memory::FLASH.contains(&address) {
            let start = (address - memory::FLASH.start) as usize;
            self.flash[start..start + bytes.len()].copy_from_slice(bytes);
        }
        Ok(self.core.write_memory(place, bytes)?)
    }

    /// The function at `address` returns at once.
    pub fn skip(&mut self, address: u32) -> Result<(), RobotError> {
        if self.skipped.insert(address) && !self.sites.contains_key(&address) {
            self.core.trap_instruction(address)?;
        }
        Ok(())
    }

    /// What happened since the last call.
    pub fn take_events(&mut self, board: &mut impl Board) -> Vec<TimedEvent> {
        let mut events = std::mem::take(&mut self.events);
        events.extend(board.take_events().into_iter().map(|(time, event)| TimedEvent {
            at: Duration::from_nanos(time.nanos()),
            event: event.into(),
        }));
        events.sort_by_key(|event| event.at);
        events
    }

    /// What was counted.
    pub fn statistics(&self) -> CoreStatistics {
        // An instruction is a cycle.
        CoreStatistics { cycles: self.statistics.instructions, ..self.statistics.clone() }
    }

    /// As the bootloader does.
    fn start(&mut self, board: &mut impl Board) -> Result<(), RobotError> {
        let start = board.start(self.vectors);
        for (address, bytes) in &start.memory {
            self.write_memory(*address, bytes)?;
        }
        let vectors = (self.vectors - memory::FLASH.start) as usize;
        let word = |at: usize| {
            let bytes = self.flash.get(at..at + 4).and_then(|bytes| bytes.try_into().ok());
            bytes.map_or(u32::MAX, u32::from_le_bytes)
        };
        self.core.reset(word(vectors), word(vectors + 4), start.vector_table)?;
        self.state = if start.is_in_loader { State::InLoader } else { State::Running };
        self.event = false;
        Ok(())
    }

    fn reset(&mut self, board: &mut impl Board, cause: ResetCause) -> Result<(), RobotError> {
        board.reset(cause);
        self.report(board, Event::Reset { cause: cause.name().into() });
        self.start(board)
    }

    fn report(&mut self, board: &impl Board, event: Event) {
        self.events.push(TimedEvent { at: Duration::from_nanos(board.now().nanos()), event });
    }

    /// Lets time pass on the board. Returns whether the board reset the core meanwhile; then it is not later
    /// than that.
    fn pass(&mut self, board: &mut impl Board, to: Time) -> Result<bool, RobotError> {
        while board.now() < to {
            board.advance(next_event(board, to));
            self.move_data(board)?;
            if let Some(cause) = board.take_reset_request() {
                self.reset(board, cause)?;
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Moves what the DMA controller wants moved. Where there is no memory it reads 0 and loses what it writes.
    fn move_data(&mut self, board: &mut impl Board) -> Result<(), RobotError> {
        while board.wants_memory()
            && let Some(transfer) = board.next_transfer()
        {
            let (from, width) = transfer.from;
            let mut bytes = [0; 4];
            let value = if self.read_memory(from, &mut bytes[..width.bytes() as usize])? {
                u32::from_le_bytes(bytes)
            } else {
                board.read(from, width)
            };
            let (to, width) = transfer.to;
            if !self.write_memory(to, &value.to_le_bytes()[..width.bytes() as usize])? {
                board.write(to, width, value);
            }
        }
        Ok(())
    }

    /// Lets an executed instruction's time pass that QEMU did not count.
    fn count(&mut self, board: &mut impl Board) -> Result<bool, RobotError> {
        self.statistics.instructions += 1;
        self.pass(board, board.now() + Time::of_ticks(1, board.core_clock_hz()))
    }

    /// Shows the core the board's interrupt lines. Returns whether one rose: then an exception will be taken,
    /// which sets the event register (B1.5.18), unless it is masked; that WFE may end early is allowed.
    fn connect(&mut self, board: &impl Board) -> bool {
        let rose = self.core.set_lines(board.interrupts().bits());
        self.event |= rose;
        rose
    }

    /// The core runs until the next event of the board, or until it needs the bridge.
    fn execute(&mut self, board: &mut impl Board, until: Time) -> Result<(), RobotError> {
        self.connect(board);
        let clock = board.core_clock_hz();
        let span = next_event(board, until) - board.now();
        let stopped = match self.core.run(span.ticks(clock).max(1)) {
            Err(error) if error.is_end() => return self.ended(board),
            stopped => stopped?,
        };
        let started = board.now();
        if self.pass(board, started + Time::of_ticks(stopped.instructions, clock))? {
            // What it executed after the reset, in QEMU, never happened.
            self.statistics.instructions += (board.now() - started).ticks(clock);
            return Ok(());
        }
        self.statistics.instructions += stopped.instructions;
        match stopped.cause {
            Cause::Time => Ok(()),
            Cause::Access => self.access(board),
            Cause::Breakpoint => self.breakpoint(board),
        }
    }

    /// The core waits: time jumps to the board's next event.
    fn wait(&mut self, board: &mut impl Board, until: Time) -> Result<(), RobotError> {
        if self.pass(board, next_event(board, until))? {
            return Ok(());
        }
        if self.connect(board) && self.core.is_exception_pending()? {
            self.state = State::Running;
        }
        Ok(())
    }

    /// The core is about to access something trapped.
    fn access(&mut self, board: &mut impl Board) -> Result<(), RobotError> {
        let outcome = access::perform(&mut self.core, board, &self.flash)?;
        self.move_data(board)?;
        self.connect(board);
        match outcome {
            Outcome::Done => self.count(board).map(drop),
            Outcome::SystemReset => self.reset(board, ResetCause::Software),
            Outcome::SysTick if self.systick_reported => Ok(()),
            Outcome::SysTick => {
                self.systick_reported = true;
                self.report(board, Event::HardwareError { text: SYSTICK_USED.into() });
                Ok(())
            }
        }
    }

    /// QEMU ends when the core locks up.
    fn ended(&mut self, board: &impl Board) -> Result<(), RobotError> {
        let fresh = start_core(self.machine, &self.flash, &self.sites, &self.skipped)?;
        let words = std::mem::replace(&mut self.core, fresh).last_words();
        if !words.contains("Lockup") {
            return Err(RobotError::Ended(words));
        }
        let pc = words.split_once("R15=").and_then(|(_, rest)| rest.get(..8));
        let pc = pc.and_then(|digits| u32::from_str_radix(digits, 16).ok()).unwrap_or_default();
        self.state = State::LockedUp;
        self.report(board, Event::Lockup { pc });
        Ok(())
    }

    fn breakpoint(&mut self, board: &mut impl Board) -> Result<(), RobotError> {
        let pc = self.core.next.pc();
        if self.skipped.contains(&pc) {
            self.core.return_at_once();
            return Ok(());
        }
        let site = *self.sites.get(&pc).ok_or(RobotError::Unexpected { pc })?;
        if self.count(board)? {
            return Ok(());
        }
        let rose = self.connect(board);
        let layout = self.core.layout();
        let next = &mut self.core.next;
        match site.action {
            Action::SendEvent => {
                next.skip_instruction(site.length);
                self.event = true;
            }
            Action::WaitForEvent => {
                next.skip_instruction(site.length);
                if !std::mem::take(&mut self.event) && !self.core.is_exception_pending()? {
                    self.state = State::Waiting;
                }
            }
            Action::WaitForInterrupt => {
                next.skip_instruction(site.length);
                if !self.core.is_exception_pending()? {
                    self.state = State::Waiting;
                }
            }
            // What just rose is taken before the branch, or not at all.
            Action::Stay if rose => {}
            Action::Stay => self.state = State::Waiting,
            Action::SetStackPointer { register } => {
                let value = layout.relocate(next.r[usize::from(register)]);
                next.r[usize::from(Registers::SP)] = value & !3;
                next.skip_instruction(site.length);
            }
        }
        Ok(())
    }
}

/// A core that stops where the bridge is needed.
fn start_core(
    machine: Machine,
    flash: &[u8],
    sites: &HashMap<u32, Site>,
    skipped: &HashSet<u32>,
) -> Result<Core, RobotError> {
    let mut core = Core::new(machine, flash)?;
    access::trap(&mut core)?;
    let layout = core.layout();
    let needed = |site: &Site| {
        layout != Layout::Chip || !matches!(site.action, Action::SetStackPointer { .. })
    };
    let sites = sites.iter().filter(|(_, site)| needed(site)).map(|(address, _)| address);
    let mut addresses: Vec<u32> = sites.chain(skipped).copied().collect();
    addresses.sort_unstable();
    addresses.dedup();
    for address in addresses {
        core.trap_instruction(address)?;
    }
    Ok(core)
}

/// When the board will next change by itself, but at the latest at `until`; always later than now.
fn next_event(board: &impl Board, until: Time) -> Time {
    let next = board.next_event().map_or(until, |next| next.min(until));
    next.max(board.now() + Time::from_picos(1))
}
