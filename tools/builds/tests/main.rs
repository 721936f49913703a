//! The tests of this crate, as one program, so that they are linked once.

#![allow(clippy::unwrap_used, reason = "a failure here fails the test")]

mod documented;
mod floors;
mod levels;
mod licenses;
mod locked;
mod names;
mod prose;
mod runner;
mod unit_tests;
mod versions;
