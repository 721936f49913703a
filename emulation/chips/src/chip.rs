//! Differences between chips of one type.

use crate::MemoryContent;

/// The properties of a robot's STM32 that differ from chip to chip, or that the manual leaves open.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ChipProperties {
    /// Frequency in Hz of the oscillator LSI, which clocks the watchdog: 17,000 to 47,000 for an
    /// STM32F405 (data sheet DS8626).
    pub lsi_hz: u64,
    /// False if the crystal never oscillates.
    pub has_crystal: bool,
    /// The content of the RAM after a reset, and of the backup registers after a power-on.
    pub memory: MemoryContent,
    /// A debugger has control of the core.
    pub is_debugged: bool,
}

impl Default for ChipProperties {
    /// Returns a chip with the data sheet's typical values.
    fn default() -> Self {
        ChipProperties {
            lsi_hz: 32_000,
            has_crystal: true,
            memory: MemoryContent::Kept,
            is_debugged: false,
        }
    }
}
