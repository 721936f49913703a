//! A hash of the sources that decide a run of the simulator, compiled in.
//!
//! Results that are kept for later, such as the finished runs of a batch, count only for programs that
//! would compute the same. A hash of the running program is another one for each compiler and system, and
//! takes time in proportion to the program at every start.
//!
//! # Principles
//! * **Names and contents alone count.** Two clones of a commit have one hash, on any system, in any
//!   folder, and with any line ends.
//! * **In doubt a file counts.** All crates of this repository on which `bbz` depends count, with their
//!   entries in the lock file and those of their dependencies, but for the crates in a short list that
//!   decide no run. Documents and tests next to the sources do not count.
//!
//! # Cost
//! The hash is a constant of 16 characters. The build script reads 4 MB of sources when one of them has
//! changed.
//!
//! # What it will not do
//! It does not describe emulator programs and the files that a run reads; who keeps results hashes these.

#[cfg(test)]
mod tree;

/// The first 64 bits of the SHA-256 of all sources that decide a run, in hexadecimal.
pub const SOURCES: &str = env!("BITTYBUZZ_SOURCES");
