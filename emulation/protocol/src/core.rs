//! A processor core, as the robots that it plays need it.

use bittybuzz_chips::{Board, FlashChange, FlashContent, ResetCause, Time};

use crate::message::{CoreStatistics, TimedEvent};
use crate::{Control, Image, MachineError};

/// The state of a core between two turns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CoreState {
    /// It executes instructions.
    Running,
    /// WFE.
    WaitingForEvent,
    /// WFI.
    WaitingForInterrupt,
    /// A fault came where no fault may be taken.
    LockedUp {
        /// Address of the instruction.
        pc: u32,
    },
    /// Another program than the robot's runs, until the next reset.
    InLoader,
}

impl CoreState {
    /// The state after a reset: the program starts, or the chip waits in a loader.
    pub fn after_reset(is_in_loader: bool) -> Self {
        if is_in_loader { CoreState::InLoader } else { CoreState::Running }
    }

    /// Returns true if an event or an interrupt lets the core go on.
    pub fn is_waiting(self) -> bool {
        matches!(self, CoreState::WaitingForEvent | CoreState::WaitingForInterrupt)
    }
}

/// A core with the board around it, which has an image from the start. [`EmulatedRobot`](crate::EmulatedRobot) does
/// the work that is the same with every core: resets, sleep, DMA, lockups, debuggers.
pub trait Core: Sized {
    /// The chip's peripherals and the rest of the robot.
    type Board: Control;

    /// The core of robot `number` of several, whose power was just turned on with this image in its flash. The first
    /// [`reset`](Self::reset) follows.
    ///
    /// # Errors
    /// The image does not fit, or the emulation cannot start.
    fn load(number: usize, image: &Image) -> Result<Self, MachineError>;

    /// Starts the program whose vectors are at `vectors`, after the work of [`Board::start`]. A `cause` resets the chip before;
    /// none is the first start. RAM stays, unless its power was gone or the board says otherwise.
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

    /// Starts the program whose vectors are at `vectors`, with this content of the register VTOR: registers of the core and clock
    /// are as after a reset.
    ///
    /// # Errors
    /// The emulation failed.
    fn restart(&mut self, vectors: u32, vector_table: u32) -> Result<(), MachineError>;

    /// Gives RAM the content that it has when its power comes.
    ///
    /// # Errors
    /// The emulation failed.
    fn scramble(&mut self) -> Result<(), MachineError> {
        for (address, bytes) in Self::Board::MEMORY.ram_at_power_on() {
            self.write_memory(address, &bytes)?;
        }
        Ok(())
    }

    /// The board.
    fn board(&self) -> &Self::Board;

    /// The board, to be changed.
    fn board_mut(&mut self) -> &mut Self::Board;

    /// The time that the core has reached.
    fn now(&self) -> Time;

    /// Frequency of the core's clock; at 0 nothing runs.
    fn clock_hz(&self) -> u64;

    /// Brings the board to the core's time, and its interrupts to the core.
    fn catch_up(&mut self);

    /// The reset that the chip asks for, or the program by AIRCR.
    fn take_reset_request(&mut self) -> Option<ResetCause>;

    /// The time at which a timer of the core itself asks for an interrupt.
    fn next_timer_event(&self) -> Option<Time> {
        None
    }

    /// Takes the exception that is due or executes instructions, until `until` or something happens.
    ///
    /// # Errors
    /// The emulation failed.
    fn execute(&mut self, until: Time) -> Result<CoreState, MachineError>;

    /// Returns true if a core that waits, in this state, goes on. WFE consumes the event.
    ///
    /// # Errors
    /// The emulation failed.
    fn wakes(&mut self, state: CoreState) -> Result<bool, MachineError>;

    /// Returns true if a waiting core may go on at once: there is an event, or an interrupt that is pending and enabled.
    fn may_wake(&self) -> bool;

    /// Lets time pass in which the core does nothing, until `until` at most. Nothing happens on the board before.
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

    /// The function at `address` returns at once from now on: its first instruction becomes `bx lr`.
    ///
    /// # Errors
    /// As [`write_memory`](Self::write_memory).
    fn skip(&mut self, address: u32) -> Result<(), MachineError> {
        self.write_memory(address, &[0x70, 0x47])
    }

    /// Moves the data items of the DMA controller. Addresses without memory are the board's.
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

    /// The flash changes, and the core waits.
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

    /// Events in the core itself since the last call, in order.
    fn take_events(&mut self) -> Vec<TimedEvent> {
        Vec::new()
    }

    /// Counters since power-on.
    fn statistics(&self) -> CoreStatistics;
}
