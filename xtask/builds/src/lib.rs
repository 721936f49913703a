//! Programs that chores run, and images that they build: what `xtask`, the benchmarks and the long tests share.
//!
//! Each program is printed as a user would type it, so that what failed can be repeated by hand. Errors are `anyhow`'s: their only
//! reader is a person.

pub mod board;
pub mod cargo_test;
pub mod chip;
pub mod elf;
pub mod on_chip;
pub mod probe;
pub mod setup;
pub mod shell;
