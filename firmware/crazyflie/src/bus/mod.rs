//! The bus of the robot's own sensors: I2C3 at 400 kHz, SCL on PA8 and SDA on PC9.
//!
//! | address | chip |
//! |---|---|
//! | 0x18 | accelerometer of the BMI088 |
//! | 0x69 | gyroscope of the BMI088 |
//! | 0x77 | barometer |
//!
//! # Each millisecond
//! A read of a register takes 29 bits for the addresses and the register, 9 bits for each byte and
//! about 3 for the conditions. Six bytes therefore take 215 µs at 400 kHz.
//!
//! | from | to | read |
//! |---|---|---|
//! | 0 µs | 215 µs | gyroscope, 6 bytes, after its data-ready pulse |
//! | 215 µs | 430 µs | accelerometer, 6 bytes |
//! | after the motors are set | + 240 µs | barometer, 7 bytes, every 20th millisecond; not read yet |
//!
//! # Layers
//! * [`transfer`] moves one transaction over the wire, in interrupts.
//! * [`i2c3`] offers transactions to the drivers of chips, as [`embedded_hal_async::i2c::I2c`].
//! * [`recovery`] frees a bus that a chip holds, and resets the peripheral.
//!
//! **Not tried on hardware.**

pub mod i2c3;
mod recovery;
mod transfer;

pub use i2c3::{BusError, I2c3};
pub use transfer::Interrupts;
