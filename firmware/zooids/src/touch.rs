//! The touch sensor AT42QT1070 on I2C2. Three of its electrodes form the robot's top. The registers
//! are those of its data sheet, chapter 5; the values are those of SwarmUI, qt1070.c.

use embassy_stm32::Peri;
use embassy_stm32::gpio::{Input, Pull};
use embassy_stm32::peripherals::PB2;

use crate::i2c;

/// The address on the bus, 7 bits.
const ADDRESS: u8 = 0x1b;

// Registers.
const CHIP_ID: u8 = 0;
const DETECTION_STATUS: u8 = 2;
const SETUP: u8 = 32;
const CALIBRATE: u8 = 56;

/// The value of the register [`CHIP_ID`].
const QT1070: u8 = 0x2e;

/// Bits of the detection status: a key is touched; the sensor calibrates itself.
const TOUCH: u8 = 1 << 0;
const CALIBRATING: u8 = 1 << 7;

/// The register number [`SETUP`] and the values of the registers from there on: thresholds; groups
/// of keys that exclude each other, except the last; the number of detections before a touch
/// counts; fast-out and guard; a measurement every 64 ms; the longest touch. The last value starts
/// the calibration that is then required.
const VALUES: [u8; 26] = [
    SETUP, 25, 25, 25, 25, 25, 25, 25, 0x10, 0x10, 0x10, 0x10, 0x10, 0x10, 0, 4, 4, 4, 4, 4, 4, 4,
    0x17, 8, 63, 1,
];
const _: () = assert!(SETUP as usize + VALUES.len() - 2 == CALIBRATE as usize);

/// The touch sensor.
pub struct Touch {
    /// Low after a touch has begun or ended.
    change: Input<'static>,
    is_set_up: bool,
}

impl Touch {
    /// Returns the sensor, which is not set up yet.
    pub fn new(change: Peri<'static, PB2>) -> Self {
        Touch { change: Input::new(change, Pull::None), is_set_up: false }
    }

    /// Returns the new state if the touch has changed; true means touched. If the sensor does not
    /// answer, the next call reads it again.
    pub fn changed(&mut self) -> Option<bool> {
        if !self.is_set_up {
            let [id] = read(CHIP_ID)?;
            self.is_set_up = id == QT1070 && i2c::write(ADDRESS, &VALUES).is_ok();
            return None;
        }
        if self.change.is_high() {
            return None;
        }
        // The line stays low unless both registers are read.
        let [status, _keys] = read(DETECTION_STATUS)?;
        Some(status & (TOUCH | CALIBRATING) == TOUCH)
    }
}

fn read<const N: usize>(register: u8) -> Option<[u8; N]> {
    let mut values = [0; N];
    i2c::write_read(ADDRESS, register, &mut values).ok()?;
    Some(values)
}
