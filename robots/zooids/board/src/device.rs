//! A chip on the I2C bus.

use bittybuzz_chips::Time;

/// A chip with registers.
pub(super) trait Device {
    /// Returns true if the chip answers to its address.
    fn is_awake(&self, now: Time) -> bool;
    /// Sets the register pointer: the next byte is read from or written to `register`.
    fn point(&mut self, register: u8);
    /// Writes a byte and advances the register pointer.
    fn write(&mut self, byte: u8, now: Time);
    /// Reads a byte and advances the register pointer.
    fn read(&mut self, now: Time) -> u8;
}
