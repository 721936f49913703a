//! The parts of a Cortex-M around its instructions that more than one emulator needs: the interrupt controller, with its registers
//! and those of the system control block that concern it.
//!
//! From the ARMv7-M Architecture Reference Manual (DDI 0403), and what of it a Cortex-M0 has (ARMv6-M, DDI 0419).

mod nvic;
pub mod registers;

pub use nvic::{Masks, Nvic, number};
