//! The port expander PCA9554 of the Multi-ranger, whose pins hold range finders in reset.
//!
//! After power-on all pins are inputs, and the range finders run.

use embedded_hal_async::i2c::I2c;

use crate::bus::{Bus, BusError};

const ADDRESS: u8 = 0x20;
/// The registers of the levels and of the directions (pca95x4.c of crazyflie-firmware).
const OUTPUT: u8 = 1;
const CONFIGURATION: u8 = 3;

/// An expander that drives some of its pins.
pub struct Expander {
    levels: u8,
}

impl Expander {
    /// Drives these pins low, with pin P0 in bit 0. The others stay inputs.
    pub async fn start(bus: &mut Bus, pins: u8) -> Result<Self, BusError> {
        // The levels come first: pins that become outputs would be high for a moment.
        bus.write(ADDRESS, &[OUTPUT, !pins]).await?;
        bus.write(ADDRESS, &[CONFIGURATION, !pins]).await?;
        Ok(Expander { levels: !pins })
    }

    /// Drives a pin high.
    pub async fn raise(&mut self, bus: &mut Bus, pin: u8) -> Result<(), BusError> {
        self.levels |= 1 << pin;
        bus.write(ADDRESS, &[OUTPUT, self.levels]).await
    }
}
