//! The tests of this crate, as one program, so that they are linked once.

#![allow(clippy::unwrap_used, reason = "a failure here fails the test")]

mod arguments;
mod capacity;
mod checks;
mod classes;
mod compatibility;
mod conformance;
mod examples;
mod exchanged_values;
mod instruction_time;
mod language;
mod lessons;
mod malformed;
mod memory;
mod pauses;
mod protocol;
mod random_programs;
mod scenarios;
mod shared_language;
mod text_budget;
mod torture;
