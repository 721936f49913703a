//! The machine as a program on a host sees it, between two instructions or after a fault: its state, its calls with their
//! locals, tables, closures, and its memory. All of this only reads, allocates nothing, and a run is the same with and without
//! it. Firmware calls none of it, so that it takes no flash.
//!
//! Its knowledge of other robots is in [`super::network`].

mod frames;
mod instruction;
mod memory;
mod values;

pub use frames::{CallFrame, CallFrames, FramePlace};
pub use instruction::{Callee, Instruction};
pub use values::{ClosureParts, TableEntries, ValueKind};

use super::{Native, State, Vm};
use crate::builtin;
use crate::bytecode::ByteCode;
use crate::fault::Fault;
use crate::number::Profile;

/// The state of a machine.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Activity {
    /// It has no script.
    Empty,
    /// It is between two entries.
    Idle,
    /// It is in an entry, between two instructions.
    Running,
    /// It is in `delay` or in a robot function that goes on.
    Waiting,
    /// A fault has stopped the script.
    Faulted(Fault),
    /// The script stopped and has not started again: steps handle messages only.
    Resting,
}

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    /// Returns the state of the machine.
    pub fn activity(&self) -> Activity {
        let pc = usize::from(self.pc);
        let waits = [Native(builtin::DELAY), Native::ROBOT].map(Native::position);
        match self.state {
            State::Empty => Activity::Empty,
            State::Resting => Activity::Resting,
            State::Idle if self.protocol.is_resting => Activity::Resting,
            State::Idle => Activity::Idle,
            State::Running if waits.contains(&pc) => Activity::Waiting,
            State::Running => Activity::Running,
            State::Faulted(fault) => Activity::Faulted(fault),
        }
    }
}
