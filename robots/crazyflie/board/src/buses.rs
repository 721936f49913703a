//! The buses to the sensors and the expansion port.

use bittybuzz_chips::f405::F405;
use bittybuzz_chips::stm32::Pin;
use bittybuzz_chips::{BusAction, I2cBus, I2cDevice, Time};

/// Port and pin.
type PinName = (usize, u8);

/// SCL and SDA of I2C1, on the expansion port with the configuration memory, and of I2C3 with the
/// sensors. All have pull-up resistors on the board.
const I2C_PINS: [[PinName; 2]; 2] = [[(1, 6), (1, 7)], [(0, 8), (2, 9)]];
/// The alternate function that connects these pins to I2C.
const I2C_FUNCTION: u8 = 4;
/// MISO of SPI1.
const MISO: PinName = (0, 6);

/// The two I2C buses and SPI1, with the chips on them.
#[derive(Default)]
pub(crate) struct Buses {
    i2c: [I2cBus; 2],
    /// True for each I2C bus whose SDA a chip holds low.
    held: [bool; 2],
}

impl Buses {
    /// Pulls the lines of the I2C buses up.
    pub fn connect(&self, f405: &mut F405) {
        for (port, pin) in I2C_PINS.into_iter().flatten() {
            f405.drive(port, pin, true);
        }
    }

    /// Performs an action of the STM32 on I2C1 (0) or I2C3 (1), and returns its answer to the STM32.
    pub fn perform(&mut self, f405: &mut F405, bus: usize, action: BusAction, end: Time) {
        let is_connected = I2C_PINS[bus]
            .iter()
            .all(|(port, pin)| f405.ports[*port].pin(*pin) == Pin::Alternate(I2C_FUNCTION));
        let mut nothing: [&mut dyn I2cDevice; 0] = [];
        let answer = if is_connected {
            self.i2c[bus].perform(action, &mut nothing, end)
        } else {
            I2cBus::default().perform(action, &mut [], end)
        };
        f405.i2c_answered(bus, action, answer, end);
    }

    /// Exchanges a byte of SPI1. Without a selected chip, MISO has the level of its pin.
    pub fn exchange(&mut self, f405: &mut F405, _byte: u8, end: Time) {
        let (port, pin) = MISO;
        let answer = if f405.ports[port].level(pin) { 0xff } else { 0 };
        f405.spi_received(answer, end);
    }

    /// Applies what a write of the firmware has changed at the pins of the buses.
    pub fn after_write(&mut self, f405: &mut F405, now: Time) {
        for (bus, lines) in I2C_PINS.into_iter().enumerate() {
            // The lines are open drain: nothing drives them high.
            let [scl, sda] =
                lines.map(|(port, pin)| f405.ports[port].pin(pin) != Pin::Level(false));
            if let Some(release) = f405.take_i2c_release(bus) {
                self.i2c[bus].release(release, &mut [], now);
            }
            self.i2c[bus].set_lines(scl, sda, &mut [], now);
            let is_held = self.i2c[bus].is_held();
            if is_held != std::mem::replace(&mut self.held[bus], is_held) {
                let (port, pin) = lines[1];
                f405.drive(port, pin, !is_held);
                f405.set_i2c_held(bus, is_held);
            }
        }
    }
}
