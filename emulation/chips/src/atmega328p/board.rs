//! The interface between an AVR core and the board around it.

use super::Change;

/// A robot without the core of its ATmega328P. Times are in cycles of the core.
pub trait AvrBoard {
    /// Lets time pass until `cycle`.
    fn advance(&mut self, cycle: u64);

    /// The core reads a register.
    fn read(&mut self, address: u16, cycle: u64) -> u8;

    /// The core writes a register. Returns true if anything may have changed but pins.
    fn write(&mut self, address: u16, value: u8, cycle: u64) -> bool;

    /// `wdr`
    fn restart_watchdog(&mut self);

    /// `spm` at address `pc` with Z and R1:R0. Returns the change of the flash.
    fn store_program(&mut self, pc: u16, z: u16, word: u16) -> Option<Change>;

    /// Cycles in which the core does nothing more.
    fn take_halt(&mut self) -> u64;
}
