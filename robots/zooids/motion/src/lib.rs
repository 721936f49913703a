//! The localization of a robot under a projector, and its drive: the hardware-independent logic of
//! the Zooid's firmware.
//!
//! ```text
//! edges of each photodiode ──[projector]──▶ column, row ──[track]──▶ pose, extrapolated to now
//!                                                                        │
//! goal, duties of the script ──────────────[drive]◀──────────────────────┘
//!                                             └──▶ duty of each wheel ──[bridge]──▶ compare values of the timer
//! ```
//!
//! # Principles
//! 1. **No hardware and no clock.** Times are arguments, so all code is tested on the host.
//! 2. **Integers only.** The Cortex-M0 has no floating-point unit, and the library for floats takes
//!    more flash than this whole crate. Lengths are [`Length`], directions [`Angle`], and times are
//!    µs that wrap around.
//! 3. **A wrong position is worse than none.** The pixels of both photodiodes must agree with the
//!    board's measures and with the previous positions.
//!
//! # The frame of reference
//! The origin is the middle of the projected picture. Seen from above, x points to the right and y
//! up, away from the row that is projected last. Directions count anticlockwise from x.
//!
//! # Not included
//! The crate plans no paths around obstacles, and does not control the speeds of the wheels: a
//! motor only gets a duty.

#![no_std]
#![forbid(unsafe_code)]

pub mod angle;
pub mod bridge;
pub mod drive;
pub mod projector;
pub mod track;
pub mod units;

pub use angle::Angle;

/// A length or a coordinate in 1/16 mm.
pub type Length = i32;

/// The number of [`Length`] units in a mm.
pub const MM: Length = 16;
