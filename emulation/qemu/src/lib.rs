//! Stock QEMU as a core for the boards of robots: [`QemuCore`]. The modules for QEMU's process and
//! ports are public, because benchmarks count instructions with them alone.
//!
//! The core serves as a second opinion: it is QEMU's, not Unicorn's; board, protocol and image are
//! those of `bbz-emulate-stm32`. Neither QEMU nor the image is patched.
//!
//! # Mechanism
//! * Accesses to peripherals meet a watchpoint; the bridge decodes the instruction and executes it
//!   with the board's registers. WFE, WFI, SEV and branches to themselves meet breakpoints: the
//!   bridge keeps the event register, and advances the board's time to the next event while the
//!   core waits.
//! * An instruction takes one cycle of the core's clock, whose rate follows from the RCC registers.
//!   QEMU counts instructions, and stops a busy core at the board's next event (core.rs). Runs are
//!   reproducible.
//! * Interrupt lines are QEMU's own inputs, so priorities, masking and nesting are those of QEMU.
//!
//! # What it will not do
//! * It is not fast: a stop costs 0.1 to 0.2 ms, and every byte of the radio's processor ten of
//!   them.
//! * It gives the firmware no SysTick, which the bridge itself needs; an access is reported as a
//!   hardware error. Cycle counter and MPU are missing, as in QEMU.
//! * It counts neither exceptions nor the time for which interrupts are masked: these statistics
//!   stay 0.
//! * It does not keep RAM across a lockup: QEMU ends then, and a new one is started.
//! * It does not hide that QEMU 7.2 lacks core-coupled memory: see `memory::Layout`.
//! * It has no flash programming, which only the Zooid's board models, and runs one robot per
//!   program.
//!
//! The emulation was not compared with hardware.

mod access;
mod core;
pub mod gdb;
mod memory;
pub mod qemu;
pub mod qtest;
pub mod registers;
mod sites;
mod thumb;
mod turns;

pub use turns::QemuCore;
