//! Runs programs and builds images, for `xtask`, the benchmarks and the long tests.
//!
//! Each command is printed as a user would type it, so that a failure can be repeated by hand.
//! Errors are `anyhow`'s, because only people read them.

pub mod board;
pub mod chip;
pub mod copy;
pub mod elf;
pub mod on_chip;
pub mod page_tests;
pub mod probe;
pub mod programs;
pub mod python_module;
pub mod raw_binary;
pub mod release_zip;
mod seed;
pub mod setup;
pub mod test_programs;
pub mod zip;

pub use bittybuzz_shell::{self as shell, cargo_test};
