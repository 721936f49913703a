//! A driver of the Bosch BMP388 and BMP390 barometers on I2C.
//!
//! # Principles
//! 1. **A started chip is a value.** [`Barometer::start`] resets the chip, checks its identity,
//!    reads its calibration, configures it and reads the configuration back. Only it returns the
//!    type that reads samples.
//! 2. **A sample is one transaction** of seven bytes: the status and both counts. The status says
//!    if the sample is new.
//! 3. **Counts and quantities are different types.** [`BarometerCounts`] are those of the chip;
//!    [`Barometer::air`] converts them to pascals and degrees Celsius. The caller detects counts
//!    that no longer change.
//! 4. **The caller lends the bus** to each call, so chips that share a bus need no lock. A device
//!    of a shared-bus crate works as well.
//! 5. **Errors have one variant per cause**, and no input panics.
//!
//! # Configuration
//! The chip is configured as on a Crazyflie 2.1: 50 samples per second, pressure oversampled
//! eightfold, filter coefficient 3.
//!
//! # Features and cost
//! There are no features. The driver allocates nothing and uses no floating-point functions. On a
//! Cortex-M4 (`opt-level = "z"`, link-time optimization) it takes 3.8 kB of flash. A [`Barometer`]
//! takes 60 bytes. The conversion takes 13 multiplications; its rounding error in
//! single precision is at most 0.05 Pa, which are 4 mm of height.
//!
//! # What it will not do
//! The crate does not support SPI, other rates, the FIFO, and interrupts. It computes no heights:
//! these need a logarithm and the pressure at sea level.
//!
//! # Cancellation
//! A dropped future may leave a transfer unfinished: the bus driver decides its end. Start the chip
//! again afterwards.
//!
//! # Sources
//! Registers and figures are those of the data sheets BST-BMP388-DS001 and BST-BMP390-DS002 as
//! Bosch's BMP3-Sensor-API and crazyflie-firmware (sensors_bmi088_bmp3xx.c) use them. The driver
//! was not tried on hardware.
//!
//! # Use
//! ```
//! use bittybuzz_bmp3xx::{Address, Barometer, Error};
//! use embedded_hal_async::{delay::DelayNs, i2c::I2c};
//!
//! async fn pressure<B>(bus: &mut B, mut delay: impl DelayNs) -> Result<f32, Error<B::Error>>
//! where
//!     B: I2c,
//! {
//!     let barometer = Barometer::start(bus, &mut delay, Address::SdoHigh).await?;
//!     barometer.self_test(bus, &mut delay).await?;
//!     let sample = barometer.read(bus).await?;
//!     Ok(barometer.air(sample.counts).pressure_pa)
//! }
//! ```

#![no_std]
#![forbid(unsafe_code)]

mod barometer;
mod calibration;

pub use barometer::{Address, Barometer, Model, Sample};
pub use calibration::{Air, BarometerCounts};

/// A reason why the chip cannot be used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Error<E> {
    /// The bus reports an error, for example that no chip answers.
    Bus(E),
    /// The chip at this address is another one.
    WrongId { found: u8 },
    /// The chip refuses the reset. `found` is its register of errors.
    CommandRefused { found: u8 },
    /// A register does not hold the value that was written, or the register of errors (2) says that
    /// the rate is too high for the oversampling.
    ConfigurationRefused { register: u8, found: u8 },
    /// The chip does not become ready for a command, or measures nothing.
    Timeout,
    /// The calibration in the chip is damaged: its checksum is another one.
    CalibrationDamaged { stored: u8, computed: u8 },
    /// The chip reports a fatal error. `found` is its register of errors.
    Broken { found: u8 },
    /// The self-test measures values outside the operating range of the chip.
    Implausible(Air),
}

impl<E> From<E> for Error<E> {
    fn from(error: E) -> Self {
        Error::Bus(error)
    }
}
