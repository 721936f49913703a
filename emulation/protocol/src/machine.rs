//! What an emulator provides.

use std::time::Duration;

use crate::message::{CoreStatistics, TimedEvent};
use crate::{Control, Image};

/// A robot that runs an image. Its memory is reached as by a debugger; its board answers the commands that
/// concern the radio's processor.
pub trait Machine {
    /// What is around the core.
    type Board: Control;

    /// Turns the power off, erases the flash, writes the image and turns the power on. The core starts with
    /// the stack pointer and the address that stand at [`Image::vectors`], after what the board runs before it:
    /// `Board::start`.
    fn load(&mut self, image: &Image) -> Result<(), MachineError>;

    /// Runs until `until`, or until nothing can happen any more.
    fn run(&mut self, until: Duration) -> Result<Pause, MachineError>;

    /// Writes to flash or RAM.
    fn write_memory(&mut self, address: u32, bytes: &[u8]) -> Result<(), MachineError>;

    /// Reads from flash or RAM.
    fn read_memory(&mut self, address: u32, bytes: &mut [u8]) -> Result<(), MachineError>;

    /// The function at `address` returns at once from now on, until the next [`load`](Self::load): its first
    /// instruction becomes `bx lr`.
    fn skip(&mut self, address: u32) -> Result<(), MachineError> {
        self.write_memory(address, &[0x70, 0x47])
    }

    /// A debugger halts the core, which sleeps until it is let go on. Peripherals go on, but for those that the program
    /// has set to stop as well.
    ///
    /// # Errors
    /// [`MachineError::NoHalt`] by default.
    fn halt(&mut self, _halted: bool) -> Result<(), MachineError> {
        Err(MachineError::NoHalt)
    }

    /// What happened since the last call, on the board and in the core, in order.
    fn take_events(&mut self) -> Vec<TimedEvent>;

    /// What the core counted since power-on.
    fn statistics(&self) -> CoreStatistics;

    /// The board around the core.
    fn board(&mut self) -> &mut Self::Board;

    /// Until when it certainly does nothing: its core sleeps and nothing comes by itself. The past if it runs.
    fn quiet_until(&mut self) -> Duration {
        Duration::ZERO
    }
}

/// Why a run is over.
pub use crate::message::PauseReason as Pause;

/// Why a machine could not do what it was asked to.
#[derive(Clone, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MachineError {
    /// No memory there.
    #[error(
        "{length} bytes at {address:#010x} are not all in memory: flash begins at 0x08000000, RAM at 0x20000000; the \
         Crazyflie has 1 MiB, 128 KiB, and 64 KiB at 0x10000000, the Zooid 64 KiB and 8 KiB. A Kilobot has flash at 0, RAM at \
         0x800100 and EEPROM at 0x810000: 32 KiB, 2 KiB and 1 KiB"
    )]
    NoMemory {
        /// First address.
        address: u32,
        /// Number of bytes.
        length: usize,
    },
    /// The core cannot be halted.
    #[error(
        "this emulator cannot halt its core: a Crazyflie's on Unicorn and a Zooid's own Cortex-M0 can"
    )]
    NoHalt,
    /// The emulation itself failed.
    #[error("the emulation failed: {0}")]
    Emulation(String),
}
