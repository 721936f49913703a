//! The links of the robots: bytes to frames and frames to bytes.
//!
//! # Principles
//! 1. **A stream is hostile.** Bytes are lost, doubled and made up; whatever came before, the next good frame is received.
//! 2. **Raw and parsed are two types.** A [`syslink::SyslinkFrame`] has passed its checksum; a [`syslink::Packet`] also makes sense.
//! 3. **No allocation, no panic, no unsafe code**, so that all of it may run in an interrupt handler.
//!
//! # What is here
//! * [`infrared`]: swarm messages of Kilobots.
//! * [`nrf24`]: swarm messages of Zooids.
//! * [`queue`]: frames that wait for the script's step, or for the link.
//! * [`syslink`]: the serial link between the two processors of a Crazyflie, and the P2P radio frames in it.
//! * [`trace`]: what a robot tells its people: start, log lines, faults.
//!
//! # What is not
//! Drivers: they belong to the firmware of each robot.

#![no_std]
#![forbid(unsafe_code)]

pub mod infrared;
pub mod nrf24;
pub mod queue;
pub mod syslink;
pub mod trace;
