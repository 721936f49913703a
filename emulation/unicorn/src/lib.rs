//! The Unicorn Engine's Cortex-M under the boards of a robot: [`UnicornCore`].
//!
//! Unicorn executes the instructions; a [`Board`](bittybuzz_chips::Board) answers for the rest; this crate is the rest of
//! a Cortex-M4F: exceptions, the interrupt controller, SysTick and the system control block, from the
//! ARMv7-M Architecture Reference Manual (DDI 0403), and the part of them that a Cortex-M0 has (ARMv6-M, DDI 0419).
//!
//! # Principles
//! 1. **One clock cycle per instruction**, and those that a Cortex-M4 takes to enter and leave an exception.
//!    Blocks are counted when they begin, so what happens within one happens at its end. The robot is slower
//!    than that: by wait states, by the pipeline, by division.
//! 2. **The core sleeps for free.** While it waits for an event, time jumps to the next one.
//! 3. **Faults are the firmware's.** A bad access, an undefined instruction, a bad return enter its handlers;
//!    a fault within those is the lockup that it is on the chip.
//!
//! # What it will not do
//! Flush a pipeline, protect memory (MPU), or alias bits (bit-banding). Floating-point
//! registers are stacked at once, never lazily. Unicorn's Cortex-M is a Cortex-M33: it also executes
//! instructions of ARMv8-M that a Cortex-M4 does not know, and floating point before CPACR allows it. In the place of
//! a Cortex-M0 it is refused what ARMv6-M lacks, but not accesses that are not aligned.

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
