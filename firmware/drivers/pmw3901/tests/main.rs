//! The tests of this crate, as one program, so that they are linked once.

#![allow(clippy::unwrap_used, reason = "a failure here fails the test")]

mod any_bytes;
mod chip;
mod failures;
mod readings;
mod traffic;
