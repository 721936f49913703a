//! The register address of an I2C chip.

/// The register that the next byte on the bus concerns. A transfer to the chip begins with the
/// register's address.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct RegisterPointer {
    register: u8,
    expects_register: bool,
}

impl RegisterPointer {
    /// Handles a start condition.
    pub(super) fn start(&mut self, reads: bool) {
        self.expects_register = !reads;
    }

    /// Returns the register that a written byte is for, or `None` if the byte was the address of a
    /// register.
    pub(super) fn written(&mut self, byte: u8) -> Option<u8> {
        if std::mem::take(&mut self.expects_register) {
            self.register = byte;
            return None;
        }
        Some(self.register)
    }

    /// Treats the next written byte as the address of a register.
    pub(super) fn expect_register(&mut self) {
        self.expects_register = true;
    }

    /// Returns the register, and selects the next one.
    pub(super) fn increment(&mut self) -> u8 {
        let register = self.register;
        self.register = register.wrapping_add(1);
        register
    }
}
