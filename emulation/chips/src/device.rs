//! The interface of chips that a microcontroller reaches over a bus.

use crate::Time;

/// A chip on an I2C bus. Its bus calls it when the master's bits are complete.
pub trait I2cDevice {
    /// Handles a start condition with an address of seven bits, and returns true if the chip acknowledges it.
    ///
    /// # Parameters
    /// `reads`: true for a transfer to the master.
    fn start(&mut self, address: u8, reads: bool, now: Time) -> bool;

    /// Handles a byte from the master, and returns true if the chip acknowledges it.
    fn write(&mut self, byte: u8, now: Time) -> bool;

    /// Returns the next byte to the master.
    fn read(&mut self, now: Time) -> u8;

    /// Handles a stop condition.
    fn stop(&mut self, now: Time);

    /// Returns true while the chip drives SDA low outside of a transfer. The master then cannot send
    /// a start condition.
    fn holds_sda(&self) -> bool {
        false
    }

    /// Handles a pulse of SCL outside of a transfer, with which a master clears the bus (UM10204
    /// 3.1.16).
    fn clock_pulse(&mut self) {}
}

/// A chip on an SPI bus, with a line that selects it.
pub trait SpiDevice {
    /// Handles an edge of the line: true selects the chip.
    fn select(&mut self, selected: bool, now: Time);

    /// Exchanges a byte whose bits are complete now.
    fn exchange(&mut self, byte: u8, now: Time) -> u8;
}
