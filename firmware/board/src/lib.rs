//! Code for the chip that the robots with embassy share: log messages for a debug probe (`log`)
//! and the place of a hard fault (`fault`). `bittybuzz_runtime` has the code that needs no chip.
//!
//! This crate is empty on other processors than a Cortex-M.

#![no_std]
#![cfg(target_arch = "arm")]

pub mod fault;
pub mod log;
