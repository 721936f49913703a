//! The touch sensor AT42QT1070 on I2C2, three of whose electrodes are the robot's top. Registers: its data sheet, chapter 5;
//! values: SwarmUI, qt1070.c.

use embassy_stm32::Peri;
use embassy_stm32::gpio::{Input, Pull};
use embassy_stm32::i2c::{self, I2c, Master};
use embassy_stm32::mode::Blocking;
use embassy_stm32::peripherals::{I2C2, PB2, PB10, PB11};
use embassy_stm32::time::khz;

/// 7 bits.
const ADDRESS: u8 = 0x1b;

// Registers.
const CHIP_ID: u8 = 0;
const DETECTION_STATUS: u8 = 2;
const SETUP: u8 = 32;
const CALIBRATE: u8 = 56;

/// What [`CHIP_ID`] holds.
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
    i2c: I2c<'static, Blocking, Master>,
    /// Low when the status has changed since it was read.
    change: Input<'static>,
    is_set_up: bool,
}

impl Touch {
    /// Takes the pins.
    pub fn new(
        peripheral: Peri<'static, I2C2>,
        change: Peri<'static, PB2>,
        (scl, sda): (Peri<'static, PB10>, Peri<'static, PB11>),
    ) -> Self {
        let mut config = i2c::Config::default();
        config.frequency = khz(400);
        Touch {
            i2c: I2c::new_blocking(peripheral, scl, sda, config),
            change: Input::new(change, Pull::None),
            is_set_up: false,
        }
    }

    /// Whether there is a touch now, if that has changed. One that does not answer is asked again the next time.
    pub fn changed(&mut self) -> Option<bool> {
        if !self.is_set_up {
            let [id] = self.read(CHIP_ID)?;
            self.is_set_up = id == QT1070 && self.i2c.blocking_write(ADDRESS, &VALUES).is_ok();
            return None;
        }
        if self.change.is_high() {
            return None;
        }
        // Both are read, else the line stays low.
        let [status, _keys] = self.read(DETECTION_STATUS)?;
        Some(status & (TOUCH | CALIBRATING) == TOUCH)
    }

    fn read<const N: usize>(&mut self, register: u8) -> Option<[u8; N]> {
        let mut values = [0; N];
        self.i2c.blocking_write_read(ADDRESS, &[register], &mut values).ok()?;
        Some(values)
    }
}
