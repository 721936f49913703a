//! An emulated robot: the code that all cores share.

use std::time::Duration;

use bittybuzz_chips::{Board, ResetCause, Time};

use crate::message::{CoreStatistics, EmulatorEvent, TimedEvent};
use crate::{Core, CoreState, FirmwareImage, MachineError, Pause};

/// A robot that runs an image, with access to its memory as through a debugger.
pub struct EmulatedRobot<C> {
    core: C,
    state: CoreState,
    /// True while a debugger halts the core.
    is_halted: bool,
    vectors: u32,
    events: Vec<TimedEvent>,
}

impl<C: Core> EmulatedRobot<C> {
    /// Creates robot `number` of several, whose power was just turned on with this image in its
    /// flash. The board's own start-up code, [`Board::start`], runs first; then the core takes its
    /// stack pointer and entry point from [`FirmwareImage::vectors`].
    ///
    /// # Errors
    /// The image does not fit, or the emulation cannot start.
    pub fn load(number: usize, image: &FirmwareImage) -> Result<Self, MachineError> {
        let mut core = C::load(number, image)?;
        let vectors = image.vectors();
        let state = core.reset(None, vectors)?;
        Ok(EmulatedRobot { core, state, is_halted: false, vectors, events: Vec::new() })
    }

    /// Runs until `until`, or until nothing more can happen.
    ///
    /// # Errors
    /// The emulation failed.
    pub fn run(&mut self, until: Duration) -> Result<Pause, MachineError> {
        let until = Time::from_nanos(u64::try_from(until.as_nanos()).unwrap_or(u64::MAX));
        loop {
            self.core.catch_up();
            if self.core.board().wants_memory() {
                self.core.move_data()?;
                if let Some(change) = self.core.board_mut().take_flash_change() {
                    self.core.change_flash(change)?;
                }
                self.core.catch_up();
            }
            if !self.core.board().is_powered() {
                return Ok(Pause::PowerOff);
            }
            if let Some(cause) = self.core.take_reset_request() {
                self.reset(cause)?;
            }
            if self.core.now() >= until {
                return Ok(self.pause());
            }
            self.step(until)?;
        }
    }

    /// Returns the reason of a pause at the end of the requested time.
    fn pause(&self) -> Pause {
        let is_locked_up = matches!(self.state, CoreState::LockedUp { .. });
        if is_locked_up && !self.core.board().watchdog_runs() { Pause::Lockup } else { Pause::Time }
    }

    fn step(&mut self, until: Time) -> Result<(), MachineError> {
        match self.state {
            _ if self.is_halted => self.sleep(until),
            CoreState::LockedUp { .. } | CoreState::InLoader => self.sleep(until),
            CoreState::WaitingForEvent | CoreState::WaitingForInterrupt => {
                if self.core.wakes(self.state)? {
                    self.state = CoreState::Running;
                    Ok(())
                } else {
                    self.sleep(until)
                }
            }
            // Without a clock the core and the peripherals stand still; the watchdog has its own
            // clock.
            CoreState::Running if self.core.clock_hz() == 0 => self.sleep(until),
            CoreState::Running => {
                self.state = self.core.execute(self.next_event(until))?;
                if let CoreState::LockedUp { pc } = self.state {
                    self.report(EmulatorEvent::Lockup { pc });
                }
                Ok(())
            }
        }
    }

    /// Returns the time of the next event on the board or in the core's timers, at most `until`.
    fn next_event(&self, until: Time) -> Time {
        let of_board = self.core.board().next_event();
        of_board.into_iter().chain(self.core.next_timer_event()).fold(until, Time::min)
    }

    /// Lets the core sleep until the next event, which may wake it.
    fn sleep(&mut self, until: Time) -> Result<(), MachineError> {
        self.core.sleep(self.next_event(until))
    }

    fn reset(&mut self, cause: ResetCause) -> Result<(), MachineError> {
        self.report(EmulatorEvent::Reset { cause: cause.name().into() });
        self.state = self.core.reset(Some(cause), self.vectors)?;
        Ok(())
    }

    fn report(&mut self, event: EmulatorEvent) {
        let at = Duration::from_nanos(self.core.now().nanos());
        self.events.push(TimedEvent { at, event });
    }

    /// Halts the core as a debugger does, or lets it continue. Peripherals continue, except those
    /// that the program has configured to stop with the core.
    pub fn halt(&mut self, is_halted: bool) {
        self.is_halted = is_halted;
        self.core.catch_up();
        self.core.board_mut().set_halted(is_halted);
    }

    /// Writes to flash or RAM.
    ///
    /// # Errors
    /// [`MachineError::NoMemory`], or the emulation failed.
    pub fn write_memory(&mut self, address: u32, bytes: &[u8]) -> Result<(), MachineError> {
        self.core.write_memory(address, bytes)
    }

    /// Reads from flash or RAM.
    ///
    /// # Errors
    /// [`MachineError::NoMemory`], or the emulation failed.
    pub fn read_memory(&mut self, address: u32, bytes: &mut [u8]) -> Result<(), MachineError> {
        self.core.read_memory(address, bytes)
    }

    /// Makes the function at `address` return at once from now on.
    ///
    /// # Errors
    /// [`MachineError::NoMemory`], or the emulation failed.
    pub fn skip(&mut self, address: u32) -> Result<(), MachineError> {
        self.core.skip(address)
    }

    /// Returns the events on the board and in the core since the last call, in order.
    pub fn take_events(&mut self) -> Vec<TimedEvent> {
        let mut events = std::mem::take(&mut self.events);
        events.extend(self.core.take_events());
        let of_board = self.core.board_mut().take_events();
        events.extend(of_board.into_iter().map(|(at, event)| TimedEvent {
            at: Duration::from_nanos(at.nanos()),
            event: event.into(),
        }));
        events.sort_by_key(|event| event.at);
        events
    }

    /// Returns the core's counters since power-on.
    pub fn statistics(&self) -> CoreStatistics {
        self.core.statistics()
    }

    /// Returns the core, for inspection.
    pub fn core(&self) -> &C {
        &self.core
    }

    /// Returns the board around the core.
    pub fn board(&mut self) -> &mut C::Board {
        self.core.board_mut()
    }

    /// Returns the time until which the robot certainly does nothing, because its core sleeps and
    /// no event is due. Returns zero if the robot may act now.
    pub(crate) fn quiet_until(&self) -> Duration {
        let (core, board) = (&self.core, self.core.board());
        let sleeps = self.state.is_waiting() || self.is_halted || core.clock_hz() == 0;
        // An event since the last turn may have woken the core.
        if !sleeps || core.may_wake() || board.wants_memory() {
            return Duration::ZERO;
        }
        let quiet = core.next_timer_event().into_iter().fold(board.quiet_until(), Time::min);
        Duration::from_nanos(quiet.nanos())
    }

    /// Returns the time before which the robot does not decide to transmit to robots of other
    /// programs, unless a command or a packet wakes it before.
    pub(crate) fn silent_until(&self) -> Duration {
        let quiet = u64::try_from(self.quiet_until().as_nanos()).unwrap_or(u64::MAX);
        let acts = self.core.now().max(Time::from_nanos(quiet));
        Duration::from_nanos(self.core.board().silent_until(acts).nanos())
    }
}
