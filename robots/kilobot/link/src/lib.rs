//! The logic of the Kilobot firmware, without the hardware. Its behavior follows kilolib and the
//! makers' tools.
//!
//! ```text
//! pulses of light ──[receiver]──▶ 12 bytes ──[life]──▶ what the robot does, of the messages of a [controller]
//!                       └ two amplitudes ──[distance]──▶ mm
//! frames of the script ──[sender]──▶ when to send them
//! duties of the script ──[motors]──▶ compare values of the timer
//! ```
//!
//! # Principles
//! 1. **No hardware and no clock.** Times are arguments, so all code is tested on the host.
//! 2. **Compatible with kilolib**, wherever two robots, the overhead controller or KiloGUI could
//!    notice a difference. The source is kilolib (revision b95fdaf), and measurements where the
//!    source does not determine the behavior.
//! 3. **Sixteen bits at most, no division in interrupts.** The processor has eight bits and
//!    executes 8 million cycles per second.
//!
//! # Not included
//! `bittybuzz_comms` handles swarm messages. The robot's own boot loader stays in place.

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
