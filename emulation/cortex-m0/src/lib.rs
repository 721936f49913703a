//! A Cortex-M0 for the boards of `bittybuzz-chips`: [`CortexM0`] runs a firmware image as it is flashed.
//!
//! The core's instructions, exceptions and interrupt controller are written from the ARMv6-M Architecture Reference Manual
//! (DDI 0419), the cycles from the Cortex-M0 Technical Reference Manual (DDI 0432). A library without foreign code: a swarm of
//! robots may live in one process, and in one that is not under the licence of somebody's emulator.
//!
//! # Principles
//! 1. **Fast enough for swarms.** Instructions in flash are decoded once and executed by straight lines; whoever sleeps costs nothing; the board is asked only
//!    when a register of it is touched or its next event is due.
//! 2. **Cycles are the manual's**, with memory that never waits: at 48 MHz the chip's flash makes some instructions wait.
//! 3. **Faults are the firmware's**: what is undefined, not aligned or nowhere is a HardFault, and one within that a lockup.
//!
//! # What it will not do
//! SysTick (its registers read 0, and a write is reported as a hardware error once), and code in RAM that is fast.
//! Not compared with hardware, but with two other cores.

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
