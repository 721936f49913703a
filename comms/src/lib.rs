//! The links of the robots: bytes to frames and frames to bytes.
//!
//! # Principles
//! 1. **A stream is hostile.** Bytes are lost, duplicated and invented. The next good frame is
//!    received whatever precedes it.
//! 2. **Raw and parsed data have different types.** A [`syslink::SyslinkFrame`] has passed its
//!    checksum; the content of a [`syslink::SyslinkPacket`] is valid as well.
//! 3. **No allocation, no panic, no unsafe code**: every function may run in an interrupt handler.
//!
//! # Modules
//! * [`infrared`]: swarm messages of Kilobots.
//! * [`long`]: messages that do not fit one frame.
//! * [`nrf24`]: swarm messages of Zooids.
//! * [`queue`]: frames that wait for the script's next step or for the link.
//! * [`syslink`]: the serial link between the two processors of a Crazyflie, and the P2P radio frames in it.
//! * [`trace`]: the reports of a robot about its script: start, log lines, faults.
//!
//! # Not included
//! Drivers belong to the firmware of each robot.

#![no_std]
#![forbid(unsafe_code)]

pub mod infrared;
pub mod long;
pub mod nrf24;
pub mod queue;
pub mod syslink;
pub mod trace;
