//! Where a robot under a projector is, and how it drives: what the Zooid's firmware computes between its pins.
//!
//! ```text
//! edges of each photodiode ──[projector]──▶ column, row ──[track]──▶ pose, extrapolated to now
//!                                                                        │
//! goal, duties of the script ──────────────[drive]◀──────────────────────┘
//!                                             └──▶ duty of each wheel ──[bridge]──▶ compare values of the timer
//! ```
//!
//! # Principles
//! 1. **No hardware and no clock.** Times are arguments, so all of it is tested on the host.
//! 2. **Integers only.** The Cortex-M0 has no floating-point unit, and the library for it takes more flash than all of this.
//!    Lengths are [`Length`], directions [`Angle`], times µs that wrap around.
//! 3. **A wrong position is worse than none.** What two photodiodes tell must agree with the board's measures and with where
//!    the robot was.
//!
//! # The frame of reference
//! The origin is the middle of the projected picture, x to the right, y up (away from the row that is projected last), as seen
//! from above. Directions count anticlockwise from x.
//!
//! # What it will not do
//! Paths around obstacles, and anything about the wheels' speeds: a duty is all that a motor is told.

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

/// [`Length`]s in a mm.
pub const MM: Length = 16;
