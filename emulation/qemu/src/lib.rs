//! Stock QEMU as a library: its process, its debugger port and its test port.
//!
//! The program `bbz-emulate-qemu` builds a robot on it; benchmarks count instructions with it.

pub mod gdb;
pub mod qemu;
pub mod qtest;
pub mod registers;
