//! The virtual machine of a Crazyflie.
//!
//! The machine is generic, so the compiler makes its code in the crate of a program, at that crate's level of
//! optimization. Firmware has the smallest level, at which the quick loop takes up to a third more instructions.
//! This crate names the machine's type and the loop, and has a faster level in the manifests of firmware and
//! benchmark. At small levels the compiler takes the code of a generic function from a crate that has it, instead of
//! making its own, and linking keeps the level of each function. `cargo xtask bench thumbv7em-full` would notice the
//! difference.
//!
//! # Cost
//! The quick loop takes 4 kB of flash at level `s`.
//!
//! # Limits
//! A machine of another type, such as that of the profile `tiny`, is made in its program.

#![no_std]
#![forbid(unsafe_code)]

use bittybuzz_vm_core::number::Full;
use bittybuzz_vm_core::{FlashArea, QuickLoop, Vm};

/// The slots of the machine: those of scripts, and the memory for other robots.
pub const SLOTS: usize = include!(concat!(env!("OUT_DIR"), "/slots.rs"));

/// The bytes of the place for an image. The firmware does not compile with another number.
pub const IMAGE_AREA: usize = 4084;

/// The room for an image.
pub type Section = FlashArea<'static, IMAGE_AREA>;

/// The machine.
pub type Machine = Vm<Full, Section, SLOTS>;

/// Returns the quick loop. Programs need not call this function: because of it the compiler makes the loop in this
/// crate.
pub fn quick_loop() -> QuickLoop<Full, Section, SLOTS> {
    Machine::quick_loop()
}
