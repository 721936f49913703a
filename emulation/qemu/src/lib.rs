//! Stock QEMU as a core under the boards of a robot: [`QemuCore`]. Benchmarks count instructions with its process and ports alone.
//!
//! A second opinion: the core is QEMU's, not Unicorn's; board, protocol and image are those of
//! `bbz-emulate-stm32`. Nothing is patched, neither QEMU nor the image.
//!
//! # How
//! * Accesses to peripherals meet a watchpoint; the bridge decodes the instruction and does it with the
//!   board's registers. WFE, WFI, SEV and branches to themselves meet breakpoints: the bridge keeps the event
//!   register, and lets the board's time jump to the next event while the core waits.
//! * An instruction takes one clock of the core, whose rate the RCC registers say. QEMU counts them, and stops
//!   a busy core at the board's next event (core.rs). Runs are reproducible.
//! * Interrupt lines are QEMU's own inputs, so priorities, masking and nesting are QEMU's.
//!
//! # What it will not do
//! * Be fast: a stop costs 0.1 to 0.2 ms, and every byte of the radio's processor ten of them.
//! * Give the firmware SysTick, which it needs itself; an access is reported as hardware error. Cycle counter
//!   and MPU are as in QEMU: none.
//! * Count exceptions, or how long interrupts were masked: these statistics stay 0.
//! * Keep RAM across a lockup: QEMU ends then, and a new one is started.
//! * Hide that QEMU 7.2 lacks core-coupled memory: see `memory::Layout`.
//! * DMA and flash programming, which only the Zooid's board models; several robots in one program.
//!
//! Not compared with hardware.

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
