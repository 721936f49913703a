//! The ports by which a ground station reaches a Crazyflie: the Crazy RealTime Protocol (CRTP) of
//! Bitcraze, so that cflib and the programs on it connect as to Bitcraze's firmware.
//!
//! # Principles
//! 1. **A packet is hostile.** CRTP has no authentication. Every length is checked, and every number
//!    must be finite and plausible; a packet that is refused is counted by its [`Refusal`].
//! 2. **Raw and verified data have different types.** A [`RawPacket`] has a length; a [`Command`] can
//!    be executed.
//! 3. **SI units, right-handed angles.** Bitcraze's degrees, millimeters, inverted pitch and packed
//!    quaternions end in the parsers. Only log variables keep them, for the station's sake.
//! 4. **No clock, no waiting, no allocation, no panic.** The caller passes the time, and takes the
//!    answers when its link has room.
//!
//! # Use
//! [`Ports::receive`] takes a packet and returns a command, an answer or both. An answer that depends
//! on the outcome is in the command. [`Ports::poll_log`] returns the log packets that are due, with
//! values that the caller reads. Values of [`Parameters`] are kept here.
//!
//! ```
//! use bittybuzz_crtp::{Command, Identity, Ports, Setpoint, SupervisorInfo};
//!
//! let mut ports = Ports::new(Identity { id: 0xe7, firmware: "example", device: "CF21" });
//! let stop = ports.receive(&[0x7c, 0], 20, &SupervisorInfo::default());
//! assert_eq!(stop.command, Some(Command::Setpoint(Setpoint::Stop)));
//! ```
//!
//! # Not included
//! The decision if a command is executed belongs to the flight controller, which knows the other
//! sources of commands. Bitcraze's C code was read for facts; none of it is here.

#![no_std]
#![forbid(unsafe_code)]

mod console;
mod fields;
mod high_level;
mod localization;
mod log;
mod memory;
mod packet;
mod parameter;
mod platform;
mod ports;
mod quaternion;
mod refusal;
mod setpoint;
mod supervisor;
mod toc;
mod trajectory;
mod value;

pub use console::console;
pub use high_level::{
    Height, HighLevelAnswer, HighLevelCommand, HighLevelOutcome, Pace, VerticalFlight,
};
pub use localization::{Localization, MeasuredPose, PeerPosition};
pub use log::LogVariable;
pub use packet::{DATA_MAX, PACKET_MAX, Packet, Port, RawPacket};
pub use parameter::{Access, Parameter, ParameterChange, Parameters};
pub use platform::Identity;
pub use ports::{Command, LINK_TIMEOUT_MS, Ports, Reaction};
pub use quaternion::pack_quaternion;
pub use refusal::{Refusal, RefusalCounts};
pub use setpoint::{FullState, Setpoint, ThrustSetpoint, Tilt, Vertical};
pub use supervisor::{ArmingAnswer, ArmingRequest, SupervisorInfo};
pub use trajectory::{PIECE_BYTES, PIECES_MAX, Piece, StoredTrajectory, TRAJECTORY_BYTES};
pub use value::{Value, WireType};
