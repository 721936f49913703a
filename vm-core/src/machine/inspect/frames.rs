//! The frames of running functions, those of built-ins included.

use super::super::{Native, SPECIAL, Vm, VmState};
use crate::bytecode::ByteCode;
use crate::image::PARAMETERS;
use crate::number::Profile;
use crate::value::Value;

/// A function that is running.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct CallFrame {
    /// The slot of its record, from which locals are counted. A called function has a higher slot
    /// than its caller.
    pub slot: u16,
    /// The first slot after its locals and operands. The operands include the arguments of the
    /// function that it calls.
    pub end: u16,
    pub place: FramePlace,
}

/// The function of a frame, and its place in the code.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum FramePlace {
    /// A function of the script.
    Script {
        /// The number of the function.
        function: u16,
        /// The number of its parameters, in the slots below the record.
        parameters: u8,
        /// The offset from the start of the code. In the innermost frame between two instructions
        /// this is the first byte of the next instruction; else it is the last byte of the
        /// instruction that made a call or stopped the script.
        position: u16,
    },
    /// A built-in that calls functions of the script or waits, by its number in
    /// [`builtin`](crate::builtin).
    Builtin(u8),
    /// A robot function that is not finished, by the number of its import.
    Robot(u16),
    /// The machine handles messages before `step()`.
    Messages,
    /// The machine is about to call an entry that is not a plain function.
    Entry,
    /// The machine copies a library to a table for a built-in that needs one.
    LibraryCopy,
}

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    /// Returns the functions that are running, innermost first. After a fault these are the
    /// functions that the fault stopped.
    pub fn frames(&self) -> CallFrames<'_, P, C, SLOTS> {
        let is_between = self.state == VmState::Running;
        let is_in_entry = is_between || matches!(self.state, VmState::Faulted(_));
        let pc = if is_in_entry { usize::from(self.pc) } else { Native::EXIT.position() };
        CallFrames { vm: self, pc, fp: self.fp.into(), end: self.sp, is_between }
    }

    /// Returns a slot of a frame by its offset from the record, as instructions name it: parameters
    /// have negative offsets, locals and operands positive ones. Returns `None` if the frame has no
    /// such slot.
    pub fn local_of(&self, frame: &CallFrame, offset: i16) -> Option<Value<P>> {
        let FramePlace::Script { parameters, .. } = frame.place else { return None };
        let slot = frame.slot.checked_add_signed(offset)?;
        let first = frame.slot.saturating_sub(parameters.into());
        let is_local = slot != frame.slot && (first..frame.end).contains(&slot);
        is_local.then(|| self.arena.get(slot.into()))
    }
}

/// The iterator of [`Vm::frames`].
pub struct CallFrames<'a, P: Profile, C: ByteCode, const SLOTS: usize> {
    vm: &'a Vm<P, C, SLOTS>,
    pc: usize,
    fp: usize,
    end: u16,
    /// True if the next frame is between two instructions. All other frames are in the middle of an
    /// instruction.
    is_between: bool,
}

impl<P: Profile, C: ByteCode, const SLOTS: usize> Iterator for CallFrames<'_, P, C, SLOTS> {
    type Item = CallFrame;

    fn next(&mut self) -> Option<CallFrame> {
        let (pc, fp, end) = (self.pc, self.fp, self.end);
        if pc == Native::EXIT.position() {
            return None;
        }
        let back = usize::from(!core::mem::take(&mut self.is_between));
        let (caller_pc, caller) = self.vm.caller(fp);
        // Only the outermost frame has no caller.
        self.pc = if caller == fp { Native::EXIT.position() } else { caller_pc };
        self.fp = caller;
        self.end = fp as u16;
        let place =
            if pc < SPECIAL { self.script(pc.saturating_sub(back))? } else { self.native(pc, fp) };
        Some(CallFrame { slot: fp as u16, end, place })
    }
}

impl<P: Profile, C: ByteCode, const SLOTS: usize> CallFrames<'_, P, C, SLOTS> {
    /// Returns the place of a function of the script. `at` is the offset in the image of a byte of
    /// the instruction that it executes.
    fn script(&self, at: usize) -> Option<FramePlace> {
        let program = self.vm.program()?;
        let header = program.function_at(at);
        let mut numbers = 0..program.header().functions();
        let function = numbers.find(|number| program.function(*number) == header)?;
        let parameters = program.code.byte(header) & PARAMETERS;
        let position = at.wrapping_sub(program.header().code_at().into()) as u16;
        Some(FramePlace::Script { function, parameters, position })
    }

    /// Returns the place of a frame of the machine, by the position where it continues and its
    /// record.
    fn native(&self, pc: usize, fp: usize) -> FramePlace {
        match Native(pc as u8 & 0x7f) {
            Native::MESSAGES => FramePlace::Messages,
            Native::START => FramePlace::Entry,
            Native::COPY => FramePlace::LibraryCopy,
            // The function is its first local.
            Native::ROBOT => FramePlace::Robot(self.vm.arena.get(fp + 1).index() as u16),
            Native(number) => FramePlace::Builtin(number),
        }
    }
}
