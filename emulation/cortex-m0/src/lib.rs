//! An emulated Cortex-M0 for the boards of `bittybuzz-chips`: [`CortexM0`] runs the same firmware
//! image that is flashed to the chip.
//!
//! The core's instructions, exceptions and interrupt controller are written from the ARMv6-M
//! Architecture Reference Manual (DDI 0419), the cycles from the Cortex-M0 Technical Reference
//! Manual (DDI 0432). The library contains no foreign code: a swarm of robots can run in one
//! process, and the process is not bound to the license of another emulator.
//!
//! # Principles
//! 1. **Fast enough for swarms.** Instructions in flash are decoded once and executed line by line,
//!    where a line ends with an instruction that always continues elsewhere. A sleeping core costs
//!    nothing. The core calls the board only for an access to a peripheral or when the board's next
//!    event is due.
//! 2. **Cycles are the manual's**, for memory without wait states. On the chip, the flash makes
//!    some instructions wait at 48 MHz.
//! 3. **Faults are the firmware's**: an undefined instruction, an unaligned access or an access to
//!    no memory is a HardFault; a fault within a HardFault is a lockup.
//!
//! # Limits
//! SysTick is not emulated: its registers read as 0, and the first write is reported as a hardware
//! error. Code in RAM runs, but slowly. The core was not compared with hardware, but with two other
//! emulated cores.

mod bus;
mod code;
mod decode;
mod exception;
mod execute;
mod execute_rare;
mod multiple;
mod ram;
mod registers;
#[cfg(test)]
mod tests;
mod turns;

pub use turns::CortexM0;
