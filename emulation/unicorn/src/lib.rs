//! A Cortex-M that executes instructions with the Unicorn Engine, for the boards of robots:
//! [`UnicornCore`].
//!
//! Unicorn executes the instructions, and a [`Board`](bittybuzz_chips::Board) handles the
//! peripherals. This crate adds the rest of a Cortex-M4F: exceptions, the interrupt controller,
//! SysTick and the system control block, from the ARMv7-M Architecture Reference Manual (DDI 0403).
//! For a Cortex-M0 it offers the subset of ARMv6-M (DDI 0419).
//!
//! # Principles
//! 1. **One clock cycle per instruction**, plus the cycles that a Cortex-M4 takes to enter and
//!    leave an exception. The instructions of a block are counted when the block begins, so an
//!    event within a block is handled at its end. The robot is slower than that: by wait states, by
//!    the pipeline, by division.
//! 2. **Sleep costs nothing.** While the core waits for an event, time jumps to the next one.
//! 3. **Faults are the firmware's.** A bad access, an undefined instruction and a bad return enter
//!    the firmware's handlers. A fault within a handler locks the core up, as on the chip.
//!
//! # Limits
//! There is no pipeline, no memory protection (MPU) and no bit-banding. Floating-point registers
//! are stacked at once, never lazily. Unicorn's Cortex-M is a Cortex-M33: it also executes
//! instructions of ARMv8-M that a Cortex-M4 does not know, and floating point before CPACR allows
//! it. For a Cortex-M0, instructions that ARMv6-M lacks are refused, but unaligned accesses are
//! not.

mod blocks;
mod core;
mod exception;
mod memory;
mod private;
mod system;
mod systick;
#[cfg(test)]
mod tests;
mod turns;

pub use crate::core::UnicornCore;
