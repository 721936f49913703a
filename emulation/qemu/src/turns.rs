//! Core and board together: the two run in turns, each up to the point where it needs the other.

use std::collections::{HashMap, HashSet};
use std::time::Duration;

use bittybuzz_chips::{Board, FlashChange, ResetCause, Time};
use bittybuzz_emulation::message::{CoreStatistics, EmulatorEvent, TimedEvent};
use bittybuzz_emulation::{Control, Core, CoreState, FirmwareImage, MachineError};

use crate::access::{self, AccessError, AccessOutcome};
use crate::core::{CoreError, QemuMachine, QemuProcessor, StopCause};
use crate::memory::{self, MemoryLayout};
use crate::registers::CoreRegisters;
use crate::sites::{self, Site, SiteAction};

/// A core in QEMU with its board.
pub struct QemuCore<B> {
    board: B,
    core: QemuProcessor,
    machine: QemuMachine,
    flash: Vec<u8>,
    sites: HashMap<u32, Site>,
    skipped: HashSet<u32>,
    /// The event register (B1.5.18).
    event: bool,
    /// Cause of the reset that the chip or the program requested.
    reset_request: Option<ResetCause>,
    systick_reported: bool,
    events: Vec<TimedEvent>,
    statistics: CoreStatistics,
}

/// The text of the hardware error for a firmware that uses SysTick.
const SYSTICK_USED: &str = "SysTick does not work in this emulator, QEMU's is used to stop the core: \
     use a timer of the chip, or bbz-emulate-stm32";

/// A reason why the emulation cannot continue.
#[derive(Debug, thiserror::Error)]
pub enum RobotError {
    /// The core failed.
    #[error(transparent)]
    Core(#[from] CoreError),
    /// QEMU ended by itself.
    #[error("qemu-system-arm ended: {0}")]
    Ended(String),
    /// The firmware makes an access that the bridge cannot execute.
    #[error(transparent)]
    Access(#[from] AccessError),
    /// An access of the DMA controller to memory failed.
    #[error(transparent)]
    Data(MachineError),
    /// The core stopped at an address without a breakpoint.
    #[error("QEMU stopped at {pc:#010x} for no reason")]
    Unexpected {
        /// Address of the instruction.
        pc: u32,
    },
}

impl From<RobotError> for MachineError {
    fn from(error: RobotError) -> Self {
        MachineError::Emulation(error.to_string())
    }
}

impl<B: Control> Core for QemuCore<B> {
    type Board = B;

    fn load(number: usize, image: &FirmwareImage) -> Result<Self, MachineError> {
        let mut flash = vec![0xff; memory::FLASH.len()];
        for (address, bytes) in image.segments() {
            let place = address
                .checked_sub(memory::FLASH.start)
                .and_then(|start| flash.get_mut(start as usize..)?.get_mut(..bytes.len()))
                .ok_or(MachineError::NoMemory { address, length: bytes.len() })?;
            place.copy_from_slice(bytes);
        }
        let machine = QemuMachine::with(B::CORE);
        let sites = sites::find(memory::FLASH.start, &flash).collect();
        let skipped = HashSet::new();
        Ok(QemuCore {
            board: B::power_on(number),
            core: start_core(machine, &flash, &sites, &skipped)?,
            machine,
            flash,
            sites,
            skipped,
            event: false,
            reset_request: None,
            systick_reported: false,
            events: Vec::new(),
            statistics: CoreStatistics::default(),
        })
    }

    /// Leaves RAM unchanged; it is zero at the first start. Programs of the tests keep counters in
    /// it.
    fn scramble(&mut self) -> Result<(), MachineError> {
        Ok(())
    }

    fn restart(&mut self, vectors: u32, vector_table: u32) -> Result<(), MachineError> {
        let vectors = (vectors - memory::FLASH.start) as usize;
        let word = |at: usize| {
            let bytes = self.flash.get(at..at + 4).and_then(|bytes| bytes.try_into().ok());
            bytes.map_or(u32::MAX, u32::from_le_bytes)
        };
        let (stack, first) = (word(vectors), word(vectors + 4));
        self.core.reset(stack, first, vector_table).map_err(RobotError::from)?;
        self.event = false;
        Ok(())
    }

    fn board(&self) -> &B {
        &self.board
    }

    fn board_mut(&mut self) -> &mut B {
        &mut self.board
    }

    /// Returns the board's time, in which an instruction takes one cycle of the core's clock.
    fn now(&self) -> Time {
        self.board.now()
    }

    fn clock_hz(&self) -> u64 {
        self.board.core_clock_hz()
    }

    /// Does nothing: the board's time always advances together with the core's.
    fn catch_up(&mut self) {}

    fn take_reset_request(&mut self) -> Option<ResetCause> {
        self.reset_request.take().or_else(|| self.board.take_reset_request())
    }

    fn execute(&mut self, until: Time) -> Result<CoreState, MachineError> {
        Ok(self.run(until)?)
    }

    fn wakes(&mut self, _: CoreState) -> Result<bool, MachineError> {
        if !self.connect() {
            return Ok(false);
        }
        Ok(self.core.is_exception_pending().map_err(RobotError::from)?)
    }

    fn may_wake(&self) -> bool {
        self.event
    }

    fn sleep(&mut self, until: Time) -> Result<(), MachineError> {
        self.pass(later(until, &self.board))?;
        Ok(())
    }

    fn write_memory(&mut self, address: u32, bytes: &[u8]) -> Result<(), MachineError> {
        match self.write(address, bytes)? {
            true => Ok(()),
            false => Err(MachineError::NoMemory { address, length: bytes.len() }),
        }
    }

    fn read_memory(&mut self, address: u32, bytes: &mut [u8]) -> Result<(), MachineError> {
        match self.read(address, bytes)? {
            true => Ok(()),
            false => Err(MachineError::NoMemory { address, length: bytes.len() }),
        }
    }

    fn skip(&mut self, address: u32) -> Result<(), MachineError> {
        if self.skipped.insert(address) && !self.sites.contains_key(&address) {
            self.core.trap_instruction(address).map_err(RobotError::from)?;
        }
        Ok(())
    }

    /// Does nothing: the firmware cannot program QEMU's flash, so it is not erased either.
    fn change_flash(&mut self, _: FlashChange) -> Result<(), MachineError> {
        Ok(())
    }

    fn take_events(&mut self) -> Vec<TimedEvent> {
        std::mem::take(&mut self.events)
    }

    fn statistics(&self) -> CoreStatistics {
        // An instruction takes one cycle.
        CoreStatistics { cycles: self.statistics.instructions, ..self.statistics.clone() }
    }
}

impl<B: Control> QemuCore<B> {
    /// Reads memory as a debugger does; returns false if there is none.
    fn read(&mut self, address: u32, bytes: &mut [u8]) -> Result<bool, RobotError> {
        match self.core.layout().locate(address, bytes.len()) {
            Some(place) => Ok(self.core.read_memory(place, bytes)?),
            None => Ok(false),
        }
    }

    /// Writes memory as a debugger does; returns false if there is none.
    fn write(&mut self, address: u32, bytes: &[u8]) -> Result<bool, RobotError> {
        let Some(place) = self.core.layout().locate(address, bytes.len()) else {
            return Ok(false);
        };
        if memory::FLASH.contains(&address) {
            let start = (address - memory::FLASH.start) as usize;
            self.flash[start..start + bytes.len()].copy_from_slice(bytes);
        }
        Ok(self.core.write_memory(place, bytes)?)
    }

    fn report(&mut self, event: EmulatorEvent) {
        let at = Duration::from_nanos(self.board.now().nanos());
        self.events.push(TimedEvent { at, event });
    }

    /// Lets time pass on the board. Returns true if the chip requested a reset; time then stops at
    /// the request.
    fn pass(&mut self, to: Time) -> Result<bool, RobotError> {
        while self.board.now() < to {
            let next = self.board.next_event().map_or(to, |next| next.min(to));
            self.board.advance(later(next, &self.board));
            self.move_data().map_err(RobotError::Data)?;
            self.reset_request = self.reset_request.or(self.board.take_reset_request());
            if self.reset_request.is_some() {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Lets the time of an instruction pass that the bridge executed, and that QEMU did not count.
    fn count(&mut self) -> Result<bool, RobotError> {
        self.statistics.instructions += 1;
        self.pass(self.board.now() + Time::of_ticks(1, self.board.core_clock_hz()))
    }

    /// Passes the board's interrupt lines to the core. Returns true if a line rose: an exception is
    /// then taken, unless it is masked, and sets the event register (B1.5.18). A WFE that ends
    /// early in the masked case is allowed.
    fn connect(&mut self) -> bool {
        let rose = self.core.set_lines(self.board.interrupts().bits());
        self.event |= rose;
        rose
    }

    /// Lets the core run until the next event of the board, or until it needs the bridge.
    fn run(&mut self, until: Time) -> Result<CoreState, RobotError> {
        self.connect();
        let clock = self.board.core_clock_hz();
        let span = later(until, &self.board) - self.board.now();
        let stopped = match self.core.run(span.ticks(clock).max(1)) {
            Err(error) if error.is_end() => return self.ended(),
            stopped => stopped?,
        };
        let started = self.board.now();
        if self.pass(started + Time::of_ticks(stopped.instructions, clock))? {
            // Instructions after the reset were executed only in QEMU and do not count.
            self.statistics.instructions += (self.board.now() - started).ticks(clock);
            return Ok(CoreState::Running);
        }
        self.statistics.instructions += stopped.instructions;
        match stopped.cause {
            StopCause::Time => Ok(CoreState::Running),
            StopCause::Access => self.access(),
            StopCause::Breakpoint => self.breakpoint(),
        }
    }

    /// Executes an access to a trapped address, before which the core stopped.
    fn access(&mut self) -> Result<CoreState, RobotError> {
        let outcome = access::perform(&mut self.core, &mut self.board, &self.flash)?;
        self.move_data().map_err(RobotError::Data)?;
        self.connect();
        match outcome {
            AccessOutcome::Done => {
                self.count()?;
            }
            AccessOutcome::SystemReset => self.reset_request = Some(ResetCause::Software),
            AccessOutcome::SysTick if self.systick_reported => {}
            AccessOutcome::SysTick => {
                self.systick_reported = true;
                self.report(EmulatorEvent::HardwareError { text: SYSTICK_USED.into() });
            }
        }
        Ok(CoreState::Running)
    }

    /// Handles the end of QEMU, which ends when the core locks up; starts a new QEMU.
    fn ended(&mut self) -> Result<CoreState, RobotError> {
        let fresh = start_core(self.machine, &self.flash, &self.sites, &self.skipped)?;
        let words = std::mem::replace(&mut self.core, fresh).last_words();
        if !words.contains("Lockup") {
            return Err(RobotError::Ended(words));
        }
        let pc = words.split_once("R15=").and_then(|(_, rest)| rest.get(..8));
        let pc = pc.and_then(|digits| u32::from_str_radix(digits, 16).ok()).unwrap_or_default();
        Ok(CoreState::LockedUp { pc })
    }

    fn breakpoint(&mut self) -> Result<CoreState, RobotError> {
        let pc = self.core.next.pc();
        if self.skipped.contains(&pc) {
            self.core.return_at_once();
            return Ok(CoreState::Running);
        }
        let site = *self.sites.get(&pc).ok_or(RobotError::Unexpected { pc })?;
        if self.count()? {
            return Ok(CoreState::Running);
        }
        let rose = self.connect();
        let layout = self.core.layout();
        let next = &mut self.core.next;
        match site.action {
            SiteAction::SendEvent => {
                next.skip_instruction(site.length);
                self.event = true;
            }
            SiteAction::WaitForEvent => {
                next.skip_instruction(site.length);
                if !std::mem::take(&mut self.event) && !self.core.is_exception_pending()? {
                    return Ok(CoreState::WaitingForEvent);
                }
            }
            SiteAction::WaitForInterrupt => {
                next.skip_instruction(site.length);
                if !self.core.is_exception_pending()? {
                    return Ok(CoreState::WaitingForInterrupt);
                }
            }
            // An interrupt that just became pending is taken before the branch, or not at all.
            SiteAction::Stay if rose => {}
            SiteAction::Stay => return Ok(CoreState::WaitingForInterrupt),
            SiteAction::SetStackPointer { register } => {
                let value = layout.relocate(next.r[usize::from(register)]);
                next.r[usize::from(CoreRegisters::SP)] = value & !3;
                next.skip_instruction(site.length);
            }
        }
        Ok(CoreState::Running)
    }
}

/// Starts a core that stops at all places where the bridge is needed.
fn start_core(
    machine: QemuMachine,
    flash: &[u8],
    sites: &HashMap<u32, Site>,
    skipped: &HashSet<u32>,
) -> Result<QemuProcessor, RobotError> {
    let mut core = QemuProcessor::new(machine, flash)?;
    access::trap(&mut core)?;
    let layout = core.layout();
    let needed = |site: &Site| {
        layout != MemoryLayout::Chip || !matches!(site.action, SiteAction::SetStackPointer { .. })
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

/// Returns `time`, but always a time after the board's present.
fn later(time: Time, board: &impl Board) -> Time {
    time.max(board.now() + Time::from_picos(1))
}
