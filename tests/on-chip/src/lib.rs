//! Runs a batch of images, one after the other in the same machine, and folds everything that each does into a hash.
//!
//! # Principles
//! 1. **The same program everywhere**: a chip and the host differ only in where the batch lies and where the
//!    [reports](Report) go. Equal reports say that the machine does the same there, instruction by instruction.
//! 2. **Small slices.** After each slice the place of every active call goes into the hash; the batch says how many
//!    instructions a slice has, from one to many.
//! 3. **The host has the sizes of the robot**: a script that needs more memory stops at the same instruction.
//!
//! # What it will not do
//! Feed chips and compare: that is the test `same`.

#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

mod batch;
mod floats;
mod recorder;
mod report;
mod run;
mod trace;

pub use batch::{Batch, Header, SYMBOL};
pub use floats::{BLOCK_PAIRS, header_of_block, sweep};
pub use report::{End, Report};
pub use run::{run, run_batch};

/// Slots of the robots' machines, from their robot files.
pub mod slots {
    include!(concat!(env!("OUT_DIR"), "/slots.rs"));
}

/// The id of the robot.
const ROBOT_ID: u16 = 1;
