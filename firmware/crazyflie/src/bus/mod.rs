//! The two I2C buses, at 400 kHz.
//!
//! # I2C3: SCL on PA8, SDA on PC9
//! The bus of the sensors on the board.
//!
//! | address | chip |
//! |---|---|
//! | 0x18 | accelerometer of the BMI088 |
//! | 0x69 | gyroscope of the BMI088 |
//! | 0x77 | barometer |
//!
//! ## Each millisecond
//! A read of a register takes 29 bits for the addresses and the register, 9 bits for each byte and
//! about 3 for the conditions. Six bytes therefore take 215 µs at 400 kHz.
//!
//! | from | to | read |
//! |---|---|---|
//! | 0 µs | 215 µs | gyroscope, 6 bytes, after its data-ready pulse |
//! | 215 µs | 430 µs | accelerometer, 6 bytes |
//! | after the motors are set | + 240 µs | barometer, 7 bytes, every 20th millisecond |
//!
//! # I2C1: SCL on PB6, SDA on PB7
//! The bus of the expansion port. Its tasks have no deadline below 5 ms, and run in the thread
//! executor.
//!
//! | address | chip |
//! |---|---|
//! | 0x20 | port expander of the Multi-ranger |
//! | 0x29 | range finder after power-on |
//! | 0x30 to 0x35 | range finders: down, front, back, left, right, up ([`crate::decks::ranging`]) |
//! | 0x50 | the memory with the configuration of the robot, read once at the start |
//!
//! # Layers
//! * [`transfer`] moves one transaction over the wire, in interrupts.
//! * [`i2c`] offers transactions to the drivers of chips, as [`embedded_hal_async::i2c::I2c`].
//! * [`recovery`] frees a bus that a chip holds, and resets the peripheral.
//!
//! **Not tried on hardware.**

pub mod i2c;
mod recovery;
mod transfer;

pub use i2c::{Bus, BusError};
pub use transfer::Interrupts;
