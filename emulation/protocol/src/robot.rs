//! A robot in an emulator: the one shell around every core.

use std::time::Duration;

use bittybuzz_chips::{Board, ResetCause, Time};

use crate::message::{CoreStatistics, Event, TimedEvent};
use crate::{Core, CoreState, Image, MachineError, Pause};

/// A robot that runs an image. Its memory is reached as by a debugger.
pub struct EmulatedRobot<C> {
    core: C,
    state: CoreState,
    /// By a debugger.
    is_halted: bool,
    vectors: u32,
    events: Vec<TimedEvent>,
}

impl<C: Core> EmulatedRobot<C> {
    /// Robot `number` of several, whose power was just turned on with this image in its flash. The core starts with the stack
    /// pointer and the address at [`Image::vectors`], after the board's own start-up code: [`Board::start`].
    ///
    /// # Errors
    /// The image does not fit, or the emulation cannot start.
    pub fn load(number: usize, image: &Image) -> Result<Self, MachineError> {
        let mut core = C::load(number, image)?;
        let vectors = image.vectors();
        let state = core.reset(None, vectors)?;
        Ok(EmulatedRobot { core, state, is_halted: false, vectors, events: Vec::new() })
    }

    /// Runs until `until`, or until nothing can happen any more.
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

    /// The reason of a pause at the end of the time that was asked for.
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
            // Without a clock nothing runs; the watchdog has its own.
            CoreState::Running if self.core.clock_hz() == 0 => self.sleep(until),
            CoreState::Running => {
                self.state = self.core.execute(self.next_event(until))?;
                if let CoreState::LockedUp { pc } = self.state {
                    self.report(Event::Lockup { pc });
                }
                Ok(())
            }
        }
    }

    /// The time at which something happens by itself, `until` at the latest.
    fn next_event(&self, until: Time) -> Time {
        let of_board = self.core.board().next_event();
        of_board.into_iter().chain(self.core.next_timer_event()).fold(until, Time::min)
    }

    /// Lets the core sleep until something may wake it.
    fn sleep(&mut self, until: Time) -> Result<(), MachineError> {
        self.core.sleep(self.next_event(until))
    }

    fn reset(&mut self, cause: ResetCause) -> Result<(), MachineError> {
        self.report(Event::Reset { cause: cause.name().into() });
        self.state = self.core.reset(Some(cause), self.vectors)?;
        Ok(())
    }

    fn report(&mut self, event: Event) {
        let at = Duration::from_nanos(self.core.now().nanos());
        self.events.push(TimedEvent { at, event });
    }

    /// A debugger halts the core, which sleeps until it is let go on. Peripherals go on, but for those that the program has
    /// set to stop as well.
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

    /// The function at `address` returns at once from now on.
    ///
    /// # Errors
    /// [`MachineError::NoMemory`], or the emulation failed.
    pub fn skip(&mut self, address: u32) -> Result<(), MachineError> {
        self.core.skip(address)
    }

    /// Events since the last call, on the board and in the core, in order.
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

    /// Counters of the core since power-on.
    pub fn statistics(&self) -> CoreStatistics {
        self.core.statistics()
    }

    /// The core, to be looked at.
    pub fn core(&self) -> &C {
        &self.core
    }

    /// The board around the core.
    pub fn board(&mut self) -> &mut C::Board {
        self.core.board_mut()
    }

    /// The time until which it certainly does nothing: its core sleeps and nothing comes by itself. The past if it runs.
    pub(crate) fn quiet_until(&self) -> Duration {
        let (core, board) = (&self.core, self.core.board());
        let sleeps = self.state.is_waiting() || self.is_halted || core.clock_hz() == 0;
        // Something may have woken it since.
        if !sleeps || core.may_wake() || board.wants_memory() {
            return Duration::ZERO;
        }
        let quiet = core.next_timer_event().into_iter().fold(board.quiet_until(), Time::min);
        Duration::from_nanos(quiet.nanos())
    }
}
