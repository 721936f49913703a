//! The protocol between an emulator program and the programs that use it, with code for both ends.
//!
//! Emulators are programs, not libraries: some link code under the GPL, and a crash of one must not
//! end the others. They read commands from standard input and write replies and events to standard
//! output, one JSON object per line (docs/emulation.md). This crate implements both ends:
//!
//! * [`Emulator`] starts an emulator program and exchanges messages with it;
//! * [`serve`] is the command loop of such a program; it runs [`EmulatedRobot`]s, each around a
//!   [`Core`]; [`serve_robots`] runs other implementations of [`EmulatedRobots`];
//! * [`message`] has the messages, and [`FirmwareImage`] is the ELF file that an emulator loads.
//!
//! # Principles
//! 1. **One reply per command**, after the events that the command caused. The emulator sends
//!    nothing else.
//! 2. **No input ends the program**: an invalid command gets an error that names the remedy.
//! 3. **Time is simulated**, in nanoseconds since power-on. The same commands always give the same
//!    replies and events. Only a door for ground stations (`door`) lets in what another program sends.
//!
//! # What it will not do
//! It does not inspect the image beyond the means of a debugger on the robot: it reads and writes
//! memory, finds the RTT buffer, and makes functions return at once.

mod client;
mod control;
mod core;
mod door;
mod error;
mod fleet;
mod image;
pub mod message;
mod robot;
mod rtt;
mod server;
mod symbol;

pub use bittybuzz_chips::{MemoryMap, f405::F405};
pub use client::{ClientError, Emulator, RunResult};
pub use control::{CommandRefusal, Control, finite, lsi, memory, probability, within};
pub use core::{Core, CoreState};
pub use error::MachineError;
pub use fleet::serve;
pub use image::{AVR_FLASH_SIZE, FirmwareImage, FirmwareImageError};
pub use message::PauseReason as Pause;
pub use robot::EmulatedRobot;
pub use server::{CommandError, EmulatedRobots, READ_MAX, serve_robots};
pub use symbol::ElfSymbol;
