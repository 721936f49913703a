//! Bad inputs for `bbz`, and the rules that it keeps with each of them.
//!
//! A [`Kind`] makes inputs from seeds: files, arguments, streams and limits of one call of `bbz`.
//! [`Runner`] carries out the call as a process of its own, and returns the rules that it broke:
//!
//! * The process ends by itself, with a status that docs/cli.md describes, and not by a signal, a
//!   panic or a defect.
//! * A status other than 0 comes with a sentence on standard error.
//! * No output has a control character but tabs and line breaks, or one that turns the direction of
//!   text.
//! * It takes at most 10 s of processor time and 1 GiB of address space.
//! * It changes, makes and removes no file but its outputs.
//!
//! `cargo xtask soak bad_inputs` runs all of them, and a test of `bbz` some of each kind.
//!
//! # Not included
//! Inputs that one format alone can have and that need a certain message: those are in
//! `tests/malformed` and `tests/bzz/diagnostics`. This crate knows no message.

mod bases;
mod case;
pub mod controls;
mod judge;
mod kinds;
mod mutation;
#[cfg(unix)]
mod runner;

pub use kinds::{Kind, PER_KIND, kinds};
#[cfg(unix)]
pub use runner::{BrokenRules, Runner};
