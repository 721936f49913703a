//! The parts of a Cortex-M that several emulators share: the interrupt controller, with its
//! registers and those of the system control block that concern it.
//!
//! They are written from the ARMv7-M Architecture Reference Manual (DDI 0403). A Cortex-M0 has a
//! subset (ARMv6-M, DDI 0419).

mod nvic;
pub mod registers;

pub use nvic::{Masks, Nvic, number};
