//! The chips that a Crazyflie 2.1 and its decks have on their I2C and SPI buses.
//!
//! # Principles
//! 1. **Registers, timing and faults.** Noise, offsets and filters belong to the physics
//!    (robots/crazyflie/physics). A device receives the true quantity through a setter, samples it
//!    with its own clock, and converts it to its registers.
//! 2. **Time arrives with each access.** A device that drives a pin names its next edge with
//!    `next_event`; all others catch up when they are accessed.
//! 3. **Faults are part of the device.** Each device has an enum of faults, of which at most one is
//!    present.
//!
//! # Sources
//! The facts come from the data sheets, as far as their text is public, and from the drivers that
//! the manufacturers publish. Drivers of others run against the models in the tests, unmodified.
//! Where a source is silent, a comment says "choice".

pub mod bmi088;
pub mod bmp388;
pub mod eeprom_24aa64;
pub mod one_wire;
pub mod pca9554;
pub mod pmw3901;
mod register_pointer;
mod sample_clock;
mod sda_hold;
#[cfg(test)]
mod test_bus;
pub mod vl53l1x;

use register_pointer::RegisterPointer;
use sample_clock::SampleClock;
use sda_hold::SdaHold;
