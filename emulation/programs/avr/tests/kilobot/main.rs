//! The program as it is used: programs for the ATmega328P in Kilobots, against the data sheet and kilolib's figures.

#![allow(clippy::unwrap_used, reason = "what fails here fails the test")]

mod chip;
mod light;
mod robots;
