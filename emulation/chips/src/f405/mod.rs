//! The STM32F405: its peripherals, their clocks and their interrupt lines.

mod bus;

pub use bus::{Lines, Width};
