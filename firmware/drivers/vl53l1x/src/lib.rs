//! A driver of the ST VL53L1X, a laser range finder on I2C, in the way of ST's ultra-lite driver.
//!
//! # Principles
//! 1. **A started chip is a value.** [`RangeFinder::start`] waits until the chip has booted, checks
//!    its identity, writes its configuration and lets it calibrate itself. Only it returns the type
//!    that measures.
//! 2. **A look is one transaction, a reading three**: the state of the interrupt; then the result,
//!    and the acknowledgement with which the chip offers the next one.
//! 3. **A reading and a distance are different types.** [`Reading`] is the chip's own, with the
//!    number of the measurement, which reveals a chip that has stopped; [`Reading::distance`]
//!    returns meters, or the reason why there are none.
//! 4. **The caller lends the bus** to each call, so chips that share a bus need no lock. A device
//!    of a shared-bus crate works as well.
//! 5. **Errors have one variant per cause**, and no input panics.
//!
//! # Several chips
//! All chips answer at [`DEFAULT_ADDRESS`] after power-on. The caller holds the pin XSHUT of each
//! chip low, and then, one chip after the other, releases the pin, waits 2 ms, and calls
//! [`RangeFinder::move_chip`].
//!
//! # Features and cost
//! There are no features. The driver allocates nothing and uses no floating-point functions. On a
//! Cortex-M4 (`opt-level = "z"`, link-time optimization) it takes 4.7 kB of flash. Its
//! configuration takes 90 bytes of the future that writes it.
//!
//! # What it will not do
//! The crate does not support soft resets (XSHUT resets the chip), 1.8 V on the bus, other budgets,
//! regions of interest, thresholds, and the calibration of offset and crosstalk. ST's full driver
//! has a medium mode and budgets of any length; the ultra-lite way has not.
//!
//! # Cancellation
//! A dropped future may leave a transfer unfinished: the bus driver decides its end. Start the chip
//! again afterwards.
//!
//! # Sources
//! ST does not document most registers. Their names, values and order are those of ST's ultra-lite
//! driver (STSW-IMG009), as the crates vl53l1x-uld 2.0.1 and vl53l1-reg 0.1.1 and the driver of
//! Linux (vl53l1x-i2c.c) repeat them. The driver was not tried on hardware.
//!
//! # Use
//! ```
//! use bittybuzz_vl53l1x::{DEFAULT_ADDRESS, Error, Mode, RangeFinder};
//! use embedded_hal_async::{delay::DelayNs, i2c::I2c};
//!
//! async fn height<B: I2c>(bus: &mut B, mut delay: impl DelayNs) -> Result<f32, Error<B::Error>> {
//!     RangeFinder::move_chip(bus, &mut delay, DEFAULT_ADDRESS, 0x30).await?;
//!     let finder = RangeFinder::start(bus, &mut delay, 0x30).await?;
//!     finder.begin(bus, Mode::Long33Ms).await?;
//!     loop {
//!         delay.delay_ms(5).await;
//!         if let Some(reading) = finder.poll(bus).await?
//!             && let Ok(distance) = reading.distance()
//!         {
//!             return Ok(distance.meters);
//!         }
//!     }
//! }
//! ```

#![no_std]
#![forbid(unsafe_code)]

mod configuration;
mod range_finder;
mod reading;

pub use configuration::Mode;
pub use range_finder::{DEFAULT_ADDRESS, RangeFinder};
pub use reading::{Distance, RangeFault, Reading};

/// A reason why the chip cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Error<E> {
    /// The bus reports an error, for example that no chip answers.
    Bus(E),
    /// The chip at this address is another one.
    WrongId { found: u16 },
    /// The new address is not one of 0x08 to 0x77: the others have a meaning of their own on I2C.
    AddressReserved { address: u8 },
    /// The chip does not boot within 100 ms.
    BootTimeout,
    /// The first measurement, with which the chip calibrates itself, does not end within 1 s.
    CalibrationTimeout,
    /// A register does not hold the value that was written, or the chip has not measured its
    /// oscillator (register 0x00DE).
    ConfigurationRefused { register: u16, found: u32 },
}

impl<E> From<E> for Error<E> {
    fn from(error: E) -> Self {
        Error::Bus(error)
    }
}
