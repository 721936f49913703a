//! What a Kilobot does between its pins: the logic of its firmware, as kilolib and the makers' tools know it.
//!
//! ```text
//! pulses of light ──[receiver]──▶ 12 bytes ──[life]──▶ what the robot does, of the messages of a [controller]
//!                       └ two amplitudes ──[distance]──▶ mm
//! frames of the script ──[sender]──▶ when to send them
//! duties of the script ──[motors]──▶ compare values of the timer
//! ```
//!
//! # Principles
//! 1. **No hardware and no clock.** Times are arguments, so all of it is tested on the host.
//! 2. **As kilolib**, wherever two robots, the overhead controller or KiloGUI could notice a difference: the source is
//!    kilolib (revision b95fdaf), measured where it says nothing.
//! 3. **Sixteen bits at most, no division in interrupts.** The processor has eight, and 8 million cycles a second.
//!
//! # What it will not do
//! Messages of swarms: those are `bittybuzz_comms`'. The boot loader: the robot's own stays where it is.

#![no_std]
#![forbid(unsafe_code)]

pub mod calibration;
pub mod clock;
pub mod controller;
pub mod distance;
pub mod light;
pub mod mode;
pub mod motors;
pub mod phase;
pub mod receiver;
pub mod sender;
