//! The interface of a processor core to the emulated robot.

use bittybuzz_chips::{Board, FlashChange, FlashContent, ResetCause, Time};

use crate::message::{CoreStatistics, TimedEvent};
use crate::{Control, FirmwareImage, MachineError};

/// The state of a core between two calls of [`Core::execute`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CoreState {
    /// The core executes instructions.
    Running,
    /// The core sleeps after WFE, until an event.
    WaitingForEvent,
    /// The core sleeps after WFI, until an interrupt.
    WaitingForInterrupt,
    /// A fault occurred at a priority at which none can be taken.
    LockedUp {
        /// Address of the instruction.
        pc: u32,
    },
    /// A loader runs instead of the robot's program, until the next reset.
    InLoader,
}

impl CoreState {
    /// Returns the state after a reset: the program starts, or the chip waits in a loader.
    pub fn after_reset(is_in_loader: bool) -> Self {
        if is_in_loader { CoreState::InLoader } else { CoreState::Running }
    }

    /// Returns true if the core waits for an event or an interrupt.
    pub fn is_waiting(self) -> bool {
        matches!(self, CoreState::WaitingForEvent | CoreState::WaitingForInterrupt)
    }
}

/// A core with the board around it and an image in its flash.
/// [`EmulatedRobot`](crate::EmulatedRobot) does the work that all cores share: resets, sleep, DMA,
/// lockups, debuggers.
pub trait Core: Sized {
    /// The chip's peripherals and the rest of the robot.
    type Board: Control;

    /// Creates the core of robot `number` of several, whose power was just turned on with this
    /// image in its flash. The caller then calls [`reset`](Self::reset).
    ///
    /// # Errors
    /// The image does not fit, or the emulation cannot start.
    fn load(number: usize, image: &FirmwareImage) -> Result<Self, MachineError>;

    /// Starts the program with the vector table at `vectors`, after the work of [`Board::start`]. A
    /// `cause` first resets the chip; `None` means the first start. RAM keeps its content, unless
    /// it lost power or the board changes it.
    ///
    /// # Errors
    /// The emulation failed.
    fn reset(
        &mut self,
        cause: Option<ResetCause>,
        vectors: u32,
    ) -> Result<CoreState, MachineError> {
        if let Some(cause) = cause {
            self.board_mut().reset(cause);
            if cause == ResetCause::PowerOn {
                self.scramble()?;
            }
        }
        let start = self.board_mut().start(vectors);
        for (address, bytes) in &start.memory {
            self.write_memory(*address, bytes)?;
        }
        self.restart(vectors, start.vector_table)?;
        Ok(CoreState::after_reset(start.is_in_loader))
    }

    /// Starts the program with the vector table at `vectors` and sets VTOR to `vector_table`; the
    /// core's registers and clock are as after a reset.
    ///
    /// # Errors
    /// The emulation failed.
    fn restart(&mut self, vectors: u32, vector_table: u32) -> Result<(), MachineError>;

    /// Fills RAM with its content at power-on.
    ///
    /// # Errors
    /// The emulation failed.
    fn scramble(&mut self) -> Result<(), MachineError> {
        for (address, bytes) in Self::Board::MEMORY.ram_at_power_on() {
            self.write_memory(address, &bytes)?;
        }
        Ok(())
    }

    /// Returns the board.
    fn board(&self) -> &Self::Board;

    /// Returns the board, mutably.
    fn board_mut(&mut self) -> &mut Self::Board;

    /// Returns the time that the core has reached.
    fn now(&self) -> Time;

    /// Returns the frequency of the core's clock in Hz; at 0 the core stands still.
    fn clock_hz(&self) -> u64;

    /// Advances the board to the core's time, and passes its interrupts to the core.
    fn catch_up(&mut self);

    /// Takes the pending request for a reset: from the chip, or from the program by AIRCR.
    fn take_reset_request(&mut self) -> Option<ResetCause>;

    /// Returns the time at which a timer of the core itself requests an interrupt.
    fn next_timer_event(&self) -> Option<Time> {
        None
    }

    /// Takes the exception that is due or executes instructions, until `until` or until something
    /// happens that the caller must handle.
    ///
    /// # Errors
    /// The emulation failed.
    fn execute(&mut self, until: Time) -> Result<CoreState, MachineError>;

    /// Returns true if a core that waits in this state wakes. A core that waits for an event
    /// consumes it.
    ///
    /// # Errors
    /// The emulation failed.
    fn wakes(&mut self, state: CoreState) -> Result<bool, MachineError>;

    /// Returns true if a waiting core may wake at once: an event is set, or an enabled interrupt is
    /// pending.
    fn may_wake(&self) -> bool;

    /// Lets time pass without instructions, at most until `until`. The caller ensures that nothing
    /// happens on the board before.
    ///
    /// # Errors
    /// The emulation failed.
    fn sleep(&mut self, until: Time) -> Result<(), MachineError>;

    /// Writes to flash or RAM.
    ///
    /// # Errors
    /// [`MachineError::NoMemory`], or the emulation failed.
    fn write_memory(&mut self, address: u32, bytes: &[u8]) -> Result<(), MachineError>;

    /// Reads from flash or RAM.
    ///
    /// # Errors
    /// [`MachineError::NoMemory`], or the emulation failed.
    fn read_memory(&mut self, address: u32, bytes: &mut [u8]) -> Result<(), MachineError>;

    /// Makes the function at `address` return at once from now on: its first instruction becomes
    /// `bx lr`.
    ///
    /// # Errors
    /// Fails as [`write_memory`](Self::write_memory) does.
    fn skip(&mut self, address: u32) -> Result<(), MachineError> {
        self.write_memory(address, &[0x70, 0x47])
    }

    /// Moves the data items of the DMA controller. Addresses outside the memory belong to the
    /// board.
    ///
    /// # Errors
    /// The emulation failed.
    fn move_data(&mut self) -> Result<(), MachineError> {
        while let Some(transfer) = self.board_mut().next_transfer() {
            let (from, width) = transfer.from;
            let mut bytes = [0; 4];
            let value = match self.read_memory(from, &mut bytes[..width.bytes() as usize]) {
                Ok(()) => u32::from_le_bytes(bytes),
                Err(MachineError::NoMemory { .. }) => self.board_mut().read(from, width),
                Err(error) => return Err(error),
            };
            let (to, width) = transfer.to;
            if Self::Board::MEMORY.is_ram(to, width.bytes() as usize) {
                self.write_memory(to, &value.to_le_bytes()[..width.bytes() as usize])?;
            } else {
                self.board_mut().write(to, width, value);
            }
        }
        Ok(())
    }

    /// Applies a change of the flash; the core waits until it is complete.
    ///
    /// # Errors
    /// The emulation failed.
    fn change_flash(&mut self, change: FlashChange) -> Result<(), MachineError> {
        match change.content {
            FlashContent::Erased(bytes) => {
                self.write_memory(change.address, &vec![0xff; bytes as usize])?;
            }
            FlashContent::Halfword(value) => {
                self.write_memory(change.address, &value.to_le_bytes())?;
            }
        }
        self.sleep(self.now() + change.takes)
    }

    /// Returns the events in the core itself since the last call, in order.
    fn take_events(&mut self) -> Vec<TimedEvent> {
        Vec::new()
    }

    /// Returns the counters since power-on.
    fn statistics(&self) -> CoreStatistics;
}
