//! A driver of the PixArt PMW3901, an optical flow sensor on SPI: it counts by how much the picture
//! below a robot moves.
//!
//! # Principles
//! 1. **A started chip is a value.** [`FlowSensor::start`] checks the identity, resets the chip and
//!    writes its list of registers. Only it returns the type that reads the motion.
//! 2. **A reading is one transaction**, the burst of 12 bytes: 0.24 ms at 1.3 MHz, of which 0.15 ms
//!    are pauses that the chip needs.
//! 3. **Counts and quantities are different types.** [`MotionCounts`] are those of the chip since
//!    the last reading, with the quality of the picture; [`MotionCounts::angles`] converts them to
//!    radians. The caller judges the quality, and detects counts that no longer change.
//! 4. **Pauses are part of the interface.** Those while the chip is selected are operations of the
//!    SPI device ([`Operation::DelayNs`](embedded_hal_async::spi::Operation::DelayNs)), which must
//!    support them; the others use the given delay.
//! 5. **Errors have one variant per cause**, and no input panics.
//!
//! # The bus
//! The most significant bit comes first. crazyflie-firmware uses mode 0 at 1.3125 MHz; PX4 uses
//! mode 0, and the library Bitcraze_PMW3901 mode 3 at 4 MHz.
//!
//! # Features and cost
//! There are no features. The driver allocates nothing and uses no floating-point functions. On a
//! Cortex-M4 (`opt-level = "z"`, link-time optimization) it takes 2.3 kB of flash.
//!
//! # What it will not do
//! The crate does not read pictures or drive the LED. It does not distinguish a floor without
//! texture from a robot that stands still: both have no motion, and only the quality differs. The
//! chip has no self-test, and most of its registers are not documented, so the list cannot be read
//! back; the identity is checked once more at the end, which fails if the last bank was not
//! selected.
//!
//! # Cancellation
//! A dropped future may leave the chip selected: the SPI device decides that. Start the chip again
//! afterwards.
//!
//! # Sources
//! The burst, the timing and the list are those of crazyflie-firmware (pmw3901.c, pmw3901.h); the
//! library Bitcraze_PMW3901 and PX4 (PMW3901.cpp) have the same list but for a few values. The
//! driver was not tried on hardware.
//!
//! # Use
//! ```
//! use bittybuzz_pmw3901::{Error, FlowSensor};
//! use embedded_hal_async::{delay::DelayNs, spi::SpiDevice};
//!
//! async fn flow<S>(spi: &mut S, mut delay: impl DelayNs) -> Result<(), Error<S::Error>>
//! where
//!     S: SpiDevice,
//! {
//!     let sensor = FlowSensor::start(spi, &mut delay).await?;
//!     delay.delay_ms(10).await;
//!     let motion = sensor.read(spi, &mut delay).await?;
//!     if motion.has_valid_motion() {
//!         let _angles = motion.angles();
//!     }
//!     Ok(())
//! }
//! ```

#![no_std]
#![forbid(unsafe_code)]

mod motion;
mod registers;
mod sensor;

pub use motion::{FlowAngles, MotionCounts};
pub use sensor::FlowSensor;

/// A reason why the chip cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Error<E> {
    /// The bus reports an error.
    Bus(E),
    /// The chip is another one, or none is there: the identity (0x49) and its inverse (0xB6) are
    /// other numbers.
    WrongId { found: u8, found_inverse: u8 },
    /// After the list of registers the identity and its inverse are other numbers: a write was
    /// lost.
    ConfigurationRefused { found: u8, found_inverse: u8 },
}

impl<E> From<E> for Error<E> {
    fn from(error: E) -> Self {
        Error::Bus(error)
    }
}
