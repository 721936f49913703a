//! The machine as a program on a host sees it, between two instructions or after a fault: its
//! state, its calls with their locals, tables, closures, and its memory. The functions only read
//! and allocate nothing, so a run is the same with and without them. Firmware calls none of them,
//! so they take no flash.
//!
//! The module [`super::network`] has the functions for its knowledge of other robots.

mod frames;
mod instruction;
mod memory;
mod values;

pub use frames::{CallFrame, CallFrames, FramePlace};
pub use instruction::{Callee, Instruction};
pub use values::{ClosureParts, TableEntries, ValueKind};

use super::{Native, Vm, VmState};
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
    /// It is in `delay`, or in a robot function that is not finished.
    Waiting,
    /// A fault has stopped the script.
    Faulted(Fault),
    /// The script stopped after a fault and has not started again: steps handle messages only.
    Resting,
}

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    /// Returns the state of the machine.
    pub fn activity(&self) -> Activity {
        let pc = usize::from(self.pc);
        let waits = [Native(builtin::DELAY), Native::ROBOT].map(Native::position);
        match self.state {
            VmState::Empty => Activity::Empty,
            VmState::Resting => Activity::Resting,
            VmState::Idle if self.protocol.is_resting => Activity::Resting,
            VmState::Idle => Activity::Idle,
            VmState::Running if waits.contains(&pc) => Activity::Waiting,
            VmState::Running => Activity::Running,
            VmState::Faulted(fault) => Activity::Faulted(fault),
        }
    }
}
