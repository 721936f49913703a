//! The touch sensor AT42QT1070 on I2C2, three of whose electrodes are the robot's top. Registers: its data sheet, chapter 5;
//! values: SwarmUI, qt1070.c.

use embassy_stm32::Peri;
use embassy_stm32::gpio::{Input, Pull};
use embassy_stm32::peripherals::PB2;

use crate::i2c;

/// 7 bits.
const ADDRESS: u8 = 0x1b;

// Registers.
const CHIP_ID: u8 = 0;
const DETECTION_STATUS: u8 = 2;
const SETUP: u8 = 32;
const CALIBRATE: u8 = 56;

/// The content of [`CHIP_ID`].
const QT1070: u8 = 0x2e;

/// In the detection status: some key is touched; it calibrates itself.
const TOUCH: u8 = 1 << 0;
const CALIBRATING: u8 = 1 << 7;

/// From [`SETUP`] on: thresholds; keys that exclude each other, but for the last; how often a touch is seen before it counts;
/// fast-out and guard; a measurement every 64 ms; longest touch. And the calibration that is due then.
const VALUES: [u8; 26] = [
    SETUP, 25, 25, 25, 25, 25, 25, 25, 0x10, 0x10, 0x10, 0x10, 0x10, 0x10, 0, 4, 4, 4, 4, 4, 4, 4,
    0x17, 8, 63, 1,
];
const _: () = assert!(SETUP as usize + VALUES.len() - 2 == CALIBRATE as usize);

/// The sensor.
pub struct Touch {
    /// Low when a touch has begun or ended.
    change: Input<'static>,
    is_set_up: bool,
}

impl Touch {
    /// The sensor, which is not set up yet.
    pub fn new(change: Peri<'static, PB2>) -> Self {
        Touch { change: Input::new(change, Pull::None), is_set_up: false }
    }

    /// Returns true or false if the touch has changed. A sensor that does not answer is read again
    /// the next time.
    pub fn changed(&mut self) -> Option<bool> {
        if !self.is_set_up {
            let [id] = read(CHIP_ID)?;
            self.is_set_up = id == QT1070 && i2c::write(ADDRESS, &VALUES).is_ok();
            return None;
        }
        if self.change.is_high() {
            return None;
        }
        // Both are read, else the line stays low.
        let [status, _keys] = read(DETECTION_STATUS)?;
        Some(status & (TOUCH | CALIBRATING) == TOUCH)
    }
}

fn read<const N: usize>(register: u8) -> Option<[u8; N]> {
    let mut values = [0; N];
    i2c::write_read(ADDRESS, register, &mut values).ok()?;
    Some(values)
}
