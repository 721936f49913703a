//! The configuration of ST's ultra-lite driver.

/// The first register of [`DEFAULTS`].
pub const DEFAULTS_START: u16 = 0x0030;

/// The registers 0x0030 to 0x0087: an interrupt that is active high, when a new result is ready;
/// thresholds of 90 mm for the deviation and of 1 Mcps for the signal; long distances; measurements
/// are stopped. ST names no others of them.
#[rustfmt::skip]
pub const DEFAULTS: [u8; 88] = [
    0x01, 0x02, 0x00, 0x02, 0x08, 0x00, 0x08, 0x10, 0x01, 0x01, 0x00, 0x00, 0x00, 0x00, 0xff, 0x00,
    0x0f, 0x00, 0x00, 0x00, 0x00, 0x00, 0x20, 0x0b, 0x00, 0x00, 0x02, 0x0a, 0x21, 0x00, 0x00, 0x05,
    0x00, 0x00, 0x00, 0x00, 0xc8, 0x00, 0x00, 0x38, 0xff, 0x01, 0x00, 0x08, 0x00, 0x00, 0x01, 0xcc,
    0x0f, 0x01, 0xf1, 0x0d, 0x01, 0x68, 0x00, 0x80, 0x08, 0xb8, 0x00, 0x00, 0x00, 0x00, 0x0f, 0x89,
    0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x01, 0x0f, 0x0d, 0x0e, 0x0e, 0x00, 0x00, 0x02, 0xc7,
    0xff, 0x9b, 0x00, 0x00, 0x00, 0x01, 0x00, 0x00,
];

/// A distance mode with its timing budget, which is the time of a measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// At most 1.3 m, less sensitive to ambient light, 50 measurements per second.
    Short20Ms,
    /// At most 4 m, 30 measurements per second.
    Long33Ms,
}

/// The registers of a distance mode.
pub struct ModeRegisters {
    /// Registers with one byte.
    pub bytes: [(u16, u8); 4],
    /// Registers with two bytes. Those of the budget come last.
    pub words: [(u16, u16); 4],
}

impl Mode {
    /// Returns the time between two measurements, which is the budget: the chip measures without a
    /// pause.
    pub fn period_ms(self) -> u32 {
        match self {
            Mode::Short20Ms => 20,
            Mode::Long33Ms => 33,
        }
    }

    pub(crate) fn registers(self) -> ModeRegisters {
        // The calibration of the phase, the two periods of the laser, the valid phase, and the
        // initial values of the two windows; then the two budgets.
        match self {
            Mode::Short20Ms => ModeRegisters {
                bytes: [(0x004b, 0x14), (0x0060, 0x07), (0x0063, 0x05), (0x0069, 0x38)],
                words: [(0x0078, 0x0705), (0x007a, 0x0606), (0x005e, 0x0051), (0x0061, 0x006e)],
            },
            Mode::Long33Ms => ModeRegisters {
                bytes: [(0x004b, 0x0a), (0x0060, 0x0f), (0x0063, 0x0d), (0x0069, 0xb8)],
                words: [(0x0078, 0x0f0d), (0x007a, 0x0e0e), (0x005e, 0x0060), (0x0061, 0x006e)],
            },
        }
    }
}
