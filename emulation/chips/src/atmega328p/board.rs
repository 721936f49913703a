//! The interface between an AVR core and the board around it.

use super::Change;

/// Everything in a robot except the core of its ATmega328P. Times are in cycles of the core.
pub trait AvrBoard {
    /// Advances time to `cycle`.
    fn advance(&mut self, cycle: u64);

    /// Performs a read of a register by the core.
    fn read(&mut self, address: u16, cycle: u64) -> u8;

    /// Performs a write of a register by the core. Returns true if the write may have changed more
    /// than pins.
    fn write(&mut self, address: u16, value: u8, cycle: u64) -> bool;

    /// Executes `wdr`.
    fn restart_watchdog(&mut self);

    /// Executes `spm` at address `pc` with Z and R1:R0. Returns the change of the flash.
    fn store_program(&mut self, pc: u16, z: u16, word: u16) -> Option<Change>;

    /// Returns the number of cycles for which the core halts, and clears it.
    fn take_halt(&mut self) -> u64;
}
