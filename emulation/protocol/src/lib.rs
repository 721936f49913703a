//! How to drive a program that emulates a robot.
//!
//! Emulators are programs, not libraries: some link code under the GPL, and a fault of one must not end the
//! others. They read commands from standard input and write replies and events to standard output, one JSON
//! object per line (docs/emulation.md). This crate has both ends:
//!
//! * [`Emulator`] starts such a program and talks to it;
//! * [`serve`] is the loop of such a program; it drives [`EmulatedRobot`]s, each around a [`Core`], or other [`Robots`];
//! * [`message`] is what they say, [`Image`] the ELF file that they load.
//!
//! # Principles
//! 1. **One reply per command**, after the events that the command caused. Nothing is sent unasked.
//! 2. **No input ends the program**: a command that makes no sense gets an error that says what to do.
//! 3. **Time is the robot's**, in nanoseconds since power-on. The same commands give the same answers.
//!
//! # What it will not do
//! Look into the image beyond what a debugger on the robot could: it reads and writes memory, finds the
//! RTT buffer, and makes functions return at once.

mod client;
mod control;
mod core;
mod error;
mod fleet;
mod image;
pub mod message;
mod robot;
mod rtt;
mod server;

pub use client::{ClientError, Emulator, Run};
pub use control::{Control, Refusal, finite, lsi, memory, probability};
pub use core::{Core, CoreState};
pub use error::MachineError;
pub use image::{AVR_FLASH_SIZE, Image, ImageError};
pub use message::PauseReason as Pause;
pub use robot::EmulatedRobot;
pub use server::{CommandError, LONGEST_READ, Robots, serve, serve_robots};
