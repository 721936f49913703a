//! A driver of the Bosch BMI088, which is a gyroscope and an accelerometer in one package with an
//! I2C address each.
//!
//! # Principles
//! 1. **A started chip is a value.** [`Gyroscope::start`] and [`Accelerometer::start`] reset the
//!    chip, check its identity, configure it and read the configuration back. Only they return the
//!    types that read samples.
//! 2. **A sample is one transaction** of six bytes, 215 µs at 400 kHz. A sample of both chips is
//!    two.
//! 3. **Counts and quantities are different types.** A reader returns counts ([`RateCounts`],
//!    [`AccelerationCounts`]); they convert to SI units. Equal counts for several samples mean that
//!    a chip has stopped: noise changes the last bits. The caller decides when.
//! 4. **The caller lends the bus** to each call, so chips that share a bus need no lock. A device
//!    of a shared-bus crate works as well.
//! 5. **Errors have one variant per cause**, and no input panics.
//!
//! # Configuration
//! The chips are configured as on a Crazyflie 2.1: ±2000 °/s at 1,000 Hz with a bandwidth of
//! 116 Hz, and ±24 g at 1,600 Hz with 145 Hz.
//!
//! # Features and cost
//! There are no features. The driver allocates nothing and uses no floating-point functions. On a
//! Cortex-M4 (`opt-level = "z"`, link-time optimization) it takes 3.8 kB of flash, of which the
//! self-tests take 1.3 kB.
//!
//! # What it will not do
//! The crate does not support SPI, other ranges and rates, the FIFO, interrupts of the
//! accelerometer, the temperature, and the synchronization of the two chips.
//!
//! # Cancellation
//! A dropped future may leave a transfer unfinished: the bus driver decides its end. Start the chip
//! again afterwards.
//!
//! # Sources
//! Registers and figures are those of the data sheet BST-BMI088-DS001 (its sections are those of
//! revision 1.3), as Bosch's BMI08x-Sensor-API, crazyflie-firmware (sensors_bmi088_bmp3xx.c) and
//! the drivers of Linux and Zephyr use them. The driver was not tried on hardware.
//!
//! # Use
//! ```
//! use bittybuzz_bmi088::{Accelerometer, Address, DataReady, Error, Gyroscope};
//! use embedded_hal_async::{delay::DelayNs, i2c::I2c};
//!
//! async fn sample<B: I2c>(bus: &mut B, mut delay: impl DelayNs) -> Result<(), Error<B::Error>> {
//!     Accelerometer::self_test(bus, &mut delay, Address::SdoLow).await?;
//!     let accelerometer = Accelerometer::start(bus, &mut delay, Address::SdoLow).await?;
//!     let gyroscope =
//!         Gyroscope::start(bus, &mut delay, Address::SdoHigh, DataReady::Int3).await?;
//!     let _rate = gyroscope.read(bus).await?.rad_per_s();
//!     let _acceleration = accelerometer.read(bus).await?.m_per_s2();
//!     Ok(())
//! }
//! ```

#![no_std]
#![forbid(unsafe_code)]

mod accelerometer;
mod gyroscope;
mod register;

pub use accelerometer::{
    Acceleration, AccelerationCounts, Accelerometer, STANDARD_GRAVITY_M_PER_S2,
};
pub use gyroscope::{DataReady, Gyroscope, Rate, RateCounts};

/// The level of the pin that chooses a chip's address: SDO1 for the accelerometer (0x18 or 0x19),
/// SDO2 for the gyroscope (0x68 or 0x69).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Address {
    SdoLow,
    SdoHigh,
}

/// An axis of the package.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    X,
    Y,
    Z,
}

/// A reason why a chip cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Error<E> {
    /// The bus reports an error, for example that no chip answers.
    Bus(E),
    /// The chip at this address is another one.
    WrongId { found: u8 },
    /// A register does not hold the value that was written, or the accelerometer's register of
    /// errors (2) is not 0.
    ConfigurationRefused { register: u8, found: u8 },
    /// The gyroscope reports that its self-test has failed. It does not name the axis.
    GyroscopeTestFailed,
    /// The test force deflects an axis of the accelerometer too little. The difference is that
    /// between the two directions of the force, in counts of ±24 g.
    AccelerometerTestFailed { axis: Axis, difference_counts: i32 },
    /// The self-test of the gyroscope does not end.
    Timeout,
}

impl<E> From<E> for Error<E> {
    fn from(error: E) -> Self {
        Error::Bus(error)
    }
}
