//! The fault of a chip that does not release SDA.

/// The state of a chip that drives SDA low until it has seen a number of clock pulses. A chip gets
/// into this state when its master is reset while the chip sends a zero (UM10204 3.1.16).
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct SdaHold {
    pulses_left: u32,
}

impl SdaHold {
    /// Drives SDA low until this number of clock pulses; 0 releases it.
    pub(super) fn set(&mut self, pulses: u32) {
        self.pulses_left = pulses;
    }

    pub(super) fn is_low(&self) -> bool {
        self.pulses_left > 0
    }

    pub(super) fn clock_pulse(&mut self) {
        self.pulses_left = self.pulses_left.saturating_sub(1);
    }
}
