//! An I2C chip with registers that count upwards during a transfer.

use bittybuzz_chips::{I2cDevice, Time};

/// The behavior of a chip's registers.
pub trait RegisterFile {
    /// Handles a byte for a register.
    fn write(&mut self, register: u16, value: u8, now: Time);

    /// Returns the value of a register.
    fn read(&mut self, register: u16, now: Time) -> u8;

    /// Returns the address of the chip at this time, or none while it answers nothing.
    fn address(&self, now: Time) -> Option<u8>;
}

/// A chip that is reached by register numbers of one or two bytes, the high byte first.
pub struct Registers<F> {
    /// The behavior, which a test may inspect and change.
    pub file: F,
    number_bytes: usize,
    /// The bytes of the register's number that have arrived since the start condition.
    number: Vec<u8>,
    next: u16,
}

impl<F: RegisterFile> Registers<F> {
    /// Returns a chip whose register numbers have `number_bytes` bytes.
    pub fn new(file: F, number_bytes: usize) -> Registers<F> {
        Registers { file, number_bytes, number: Vec::new(), next: 0 }
    }
}

impl<F: RegisterFile> I2cDevice for Registers<F> {
    fn start(&mut self, address: u8, reads: bool, now: Time) -> bool {
        if self.file.address(now) != Some(address) {
            return false;
        }
        if !reads {
            self.number.clear();
        }
        true
    }

    fn write(&mut self, byte: u8, now: Time) -> bool {
        if self.number.len() < self.number_bytes {
            self.number.push(byte);
            self.next = self.number.iter().fold(0, |number, byte| number << 8 | u16::from(*byte));
        } else {
            self.file.write(self.next, byte, now);
            self.next = self.next.wrapping_add(1);
        }
        true
    }

    fn read(&mut self, now: Time) -> u8 {
        let value = self.file.read(self.next, now);
        self.next = self.next.wrapping_add(1);
        value
    }

    fn stop(&mut self, _now: Time) {}
}
