//! Core and board together: who waits for whom.

use std::collections::{HashMap, HashSet};
use std::time::Duration;

use bittybuzz_chips::{Crazyflie, ResetCause, Time, Width};
use bittybuzz_emulation::Pause;
use bittybuzz_emulation::message::{CoreStatistics, Event, TimedEvent};

use crate::core::{Cause, Core, CoreError, VTOR};
use crate::gdb::{GdbError, Registers};
use crate::memory::{self, Layout};
use crate::qemu::QemuError;
use crate::sites::{self, Site};
use crate::thumb::{self, DecodeError};

/// What the board answers for: peripherals, and the one-time programmable area with the unique id.
const PERIPHERALS: (u32, u32) = (0x4000_0000, 0x2000_0000);
const SYSTEM_MEMORY: (u32, u32) = (0x1fff_7000, 0x1000);
/// SysTick's registers (ARMv7-M manual, B3.3.2).
const SYSTICK: (u32, u32) = (0xe000_e010, 0x10);
/// Application interrupt and reset control (B3.2.6): the word behind VTOR.
const AIRCR: u32 = 0xe000_ed0c;
const AIRCR_KEY: u32 = 0x05fa;
const AIRCR_SYSRESETREQ: u32 = 1 << 2;

/// A robot that runs an image.
pub struct Robot {
    core: Core,
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

/// What the core does.
#[derive(Clone, Copy, PartialEq, Eq)]
enum State {
    Running,
    /// It waits for an exception (and for an event, but none comes from outside).
    Waiting,
    /// It is locked up (B1.5.15).
    LockedUp,
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
    /// An access to a peripheral that the bridge cannot do.
    #[error("the instruction at {pc:#010x} accesses a peripheral, but is {source}")]
    Instruction {
        /// Where.
        pc: u32,
        /// What is wrong.
        source: DecodeError,
    },
    /// An access that is not to what is trapped alone.
    #[error("the instruction at {pc:#010x} accesses {address:#010x} in a way that no peripheral allows")]
    Address {
        /// Where.
        pc: u32,
        /// What it accesses.
        address: u32,
    },
    /// The core stopped where nothing stops it.
    #[error("QEMU stopped at {pc:#010x} for no reason")]
    Unexpected {
        /// Where.
        pc: u32,
    },
}

impl Robot {
    /// A robot with `flash`, just turned on. The bootloader starts what `vectors` says.
    pub fn new(flash: Vec<u8>, vectors: u32) -> Result<Self, RobotError> {
        let sites = sites::find(memory::FLASH.start, &flash).collect();
        let skipped = HashSet::new();
        let mut robot = Robot {
            core: start_core(&flash, &sites, &skipped)?,
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
        robot.start()?;
        Ok(robot)
    }

    /// Runs until `until`, or until nothing can happen any more.
    pub fn run(&mut self, board: &mut Crazyflie, until: Duration) -> Result<Pause, RobotError> {
        let until = Time::from_nanos(u64::try_from(until.as_nanos()).unwrap_or(u64::MAX));
        while board.now() < until {
            if !board.is_powered() {
                return Ok(Pause::PowerOff);
            }
            match self.state {
                State::Running => self.execute(board, until)?,
                State::Waiting => self.wait(board, until)?,
                State::LockedUp if board.next_event().is_none() => return Ok(Pause::Lockup),
                State::LockedUp => {
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
    pub fn take_events(&mut self, board: &mut Crazyflie) -> Vec<TimedEvent> {
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
        self.statistics.clone()
    }

    /// As the bootloader does.
    fn start(&mut self) -> Result<(), RobotError> {
        let vectors = (self.vectors - memory::FLASH.start) as usize;
        let word = |at: usize| {
            let bytes = self.flash.get(at..at + 4).and_then(|bytes| bytes.try_into().ok());
            bytes.map_or(u32::MAX, u32::from_le_bytes)
        };
        self.core.reset(word(vectors), word(vectors + 4))?;
        self.state = State::Running;
        self.event = false;
        Ok(())
    }

    fn reset(&mut self, board: &mut Crazyflie, cause: ResetCause) -> Result<(), RobotError> {
        board.reset(cause);
        self.report(board, Event::Reset { cause: cause.name().into() });
        self.start()
    }

    fn report(&mut self, board: &Crazyflie, event: Event) {
        self.events.push(TimedEvent { at: Duration::from_nanos(board.now().nanos()), event });
    }

    /// Lets time pass on the board. Returns whether the board reset the core meanwhile; then it is not later
    /// than that.
    fn pass(&mut self, board: &mut Crazyflie, to: Time) -> Result<bool, RobotError> {
        while board.now() < to {
            board.advance(next_event(board, to));
            if let Some(cause) = board.take_reset_request() {
                self.reset(board, cause)?;
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Lets an executed instruction's time pass that QEMU did not count.
    fn count(&mut self, board: &mut Crazyflie) -> Result<bool, RobotError> {
        self.statistics.instructions += 1;
        self.pass(board, board.now() + Time::of_ticks(1, board.core_clock_hz()))
    }

    /// Shows the core the board's interrupt lines. Returns whether one rose: then an exception will be taken,
    /// or is masked; the former sets the event register (B1.5.18), the latter wakes nobody who checks.
    fn connect(&mut self, board: &Crazyflie) -> Result<bool, RobotError> {
        let rose = self.core.set_lines(board.interrupts().bits())?;
        self.event |= rose;
        Ok(rose)
    }

    /// The core runs until the next event of the board, or until it needs the bridge.
    fn execute(&mut self, board: &mut Crazyflie, until: Time) -> Result<(), RobotError> {
        self.connect(board)?;
        let clock = board.core_clock_hz();
        let span = next_event(board, until) - board.now();
        let stopped = match self.core.run(span.ticks(clock).max(1)) {
            Err(CoreError::Qemu(QemuError::Gdb(GdbError::Closed))) => return self.ended(board),
            stopped => stopped?,
        };
        self.statistics.instructions += stopped.instructions;
        if self.pass(board, board.now() + Time::of_ticks(stopped.instructions, clock))? {
            return Ok(());
        }
        match stopped.cause {
            Cause::Time => Ok(()),
            Cause::Access => self.access(board),
            Cause::Breakpoint => self.breakpoint(board),
        }
    }

    /// The core waits: time jumps to the board's next event.
    fn wait(&mut self, board: &mut Crazyflie, until: Time) -> Result<(), RobotError> {
        if self.pass(board, next_event(board, until))? {
            return Ok(());
        }
        if self.connect(board)? && self.core.is_exception_pending()? {
            self.state = State::Running;
        }
        Ok(())
    }

    fn breakpoint(&mut self, board: &mut Crazyflie) -> Result<(), RobotError> {
        let pc = self.core.next.pc();
        if self.skipped.contains(&pc) {
            self.core.return_at_once();
            return Ok(());
        }
        let site = *self.sites.get(&pc).ok_or(RobotError::Unexpected { pc })?;
        if self.count(board)? {
            return Ok(());
        }
        self.connect(board)?;
        let next = &mut self.core.next;
        match site {
            Site::SendEvent => {
                next.skip_instruction(2);
                self.event = true;
            }
            Site::WaitForEvent => {
                next.skip_instruction(2);
                if !std::mem::take(&mut self.event) && !self.core.is_exception_pending()? {
                    self.state = State::Waiting;
                }
            }
            Site::WaitForInterrupt => {
                next.skip_instruction(2);
                if !self.core.is_exception_pending()? {
                    self.state = State::Waiting;
                }
            }
            Site::Stay => self.state = State::Waiting,
            Site::SetStackPointer { register } => {
                let value = self.core.layout().relocate(next.r[usize::from(register)]);
                next.r[usize::from(Registers::SP)] = value & !3;
                next.skip_instruction(4);
            }
        }
        Ok(())
    }

    /// Does the load or store at which the core stopped.
    fn access(&mut self, board: &mut Crazyflie) -> Result<(), RobotError> {
        let pc = self.core.next.pc();
        let mut code = [0; 4];
        // The last half-word of the memory cannot be the first of two.
        if !self.read_memory(pc, &mut code)? {
            self.read_memory(pc, &mut code[..2])?;
        }
        let [first, second] = [[code[0], code[1]], [code[2], code[3]]].map(u16::from_le_bytes);
        let before = self.core.next.clone();
        let access = thumb::decode(first, second, &before)
            .map_err(|source| RobotError::Instruction { pc, source })?;
        let started = self.starts();
        if let Some((base, value)) = access.writeback {
            self.core.next.r[usize::from(base)] = value;
        }
        for (index, &register) in access.registers.iter().enumerate() {
            let address = access.address.wrapping_add(access.stride() * index as u32);
            if address % access.stride() != 0 {
                return Err(RobotError::Address { pc, address });
            }
            if access.load {
                let raw = self.load(board, address, access.width)?;
                self.core.next.r[usize::from(register)] = access.extended(raw);
            } else {
                let value = before.r[usize::from(register)];
                self.store(board, address, access.width, value)?;
            }
        }
        if let Some(status) = access.status {
            self.core.next.r[usize::from(status)] = 0;
        }
        Ok(())
    }
}
