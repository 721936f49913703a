//! Tests of the emulator through its protocol, with programs for the ATmega328P in Kilobots.
//! Expectations are from the data sheet and from kilolib's figures.

#![allow(clippy::unwrap_used, reason = "what fails here fails the test")]

mod chip;
mod light;
mod robots;
