//! Errors of an emulated robot.

/// A reason why a robot did not carry out a request.
#[derive(Clone, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MachineError {
    /// The address range is not memory.
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
    /// The emulation itself failed.
    #[error("the emulation failed: {0}")]
    Emulation(String),
}
