//! The stack frame of a function: the registers that it saves, the room for its variables, and
//! accesses to the stack above them.

use std::collections::HashMap;

use super::decode::{AsmOperation, PairOperation, flag};
use super::program::{AssemblyProgram, CodeLocation, Routine};
use super::run::{Execution, SAVED, VisibleEffect};

/// The part of the stack that a function reserves at its beginning.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StackUse {
    /// Bytes of saved registers.
    pub saved: u16,
    /// Bytes of variables.
    pub room: u16,
}

/// Finds instructions that access the part of the stack above a function's own variables in every
/// execution.
#[derive(Default)]
pub struct StackAccesses {
    /// For each instruction, the number of accesses, and how many of them were to that part.
    counts: HashMap<usize, (u32, u32)>,
}

impl StackAccesses {
    /// Counts the accesses of an execution.
    pub fn take(&mut self, run: &Execution, frame: StackUse) {
        /// The most bytes of arguments that are considered.
        const ABOVE: u16 = 64;
        let top = run.before.stack;
        let lowest = top - 1 - frame.saved;
        for event in &run.events {
            if let VisibleEffect::Load(address) | VisibleEffect::Store(address, _) = event.event {
                let (all, hits) = self.counts.entry(event.step).or_default();
                *all += 1;
                *hits += u32::from((lowest..=top + ABOVE).contains(&address));
            }
        }
    }

    /// Returns an instruction that accessed only that part.
    pub fn found(&self) -> Option<usize> {
        let always = |(_, (all, hits)): &(&usize, &(u32, u32))| all == hits && *all >= 3;
        self.counts.iter().filter(always).map(|(step, _)| *step).min()
    }
}

/// Returns the frame that a function reserves before anything else, by its own code or by a shared
/// routine.
pub fn frame(program: &AssemblyProgram, routine: &Routine, is_interrupt: bool) -> StackUse {
    let mut at = routine.start;
    let mut saved = 0;
    let mut room = 0;
    // `has_pointer`: Y holds the stack pointer. `shared_size`: the size that a shared routine gets.
    let mut has_pointer = false;
    let mut shared_size = 0;
    // The frame before a call, because the call may be one of an ordinary function.
    let mut before_call: Option<StackUse> = None;
    loop {
        let step = &program.steps[at];
        at += 1;
        match step.op {
            // Only saved registers count: another one may be an argument for a callee.
            Some(AsmOperation::Push(register))
                if !has_pointer && (is_interrupt || SAVED >> register & 1 != 0) =>
            {
                saved += 1;
            }
            Some(AsmOperation::In(0, 0x3f) | AsmOperation::Pair(PairOperation::Eor, 1, 1))
                if is_interrupt => {}
            // A shared routine takes its return address from the stack first.
            Some(AsmOperation::Pop(30 | 31)) if before_call.is_some() => {}
            Some(AsmOperation::In(28, 0x3d)) => has_pointer = true,
            Some(AsmOperation::In(29, 0x3e) | AsmOperation::Out(0x3e, 29)) if has_pointer => {}
            Some(
                AsmOperation::In(0, 0x3f)
                | AsmOperation::Flag(flag::I, false)
                | AsmOperation::Out(0x3f, 0),
            ) if has_pointer => {}
            Some(AsmOperation::Word(28, value, true)) if has_pointer => room = u16::from(value),
            Some(AsmOperation::Constant(PairOperation::Sub, 28, value)) if has_pointer => {
                room = u16::from(value)
            }
            Some(AsmOperation::Constant(PairOperation::Sbc, 29, value)) if has_pointer => {
                room |= u16::from(value) << 8;
            }
            Some(AsmOperation::Load(26, value)) if before_call.is_none() => {
                shared_size = u16::from(value)
            }
            Some(AsmOperation::Pair(PairOperation::Sub, 28, 26)) if before_call.is_some() => {
                room = shared_size
            }
            Some(AsmOperation::Pair(PairOperation::Sbc, 29, 1)) if before_call.is_some() => {}
            Some(AsmOperation::Out(0x3d, 28)) if has_pointer => {
                if before_call.is_none() {
                    return StackUse { saved, room };
                }
            }
            Some(AsmOperation::Call(..)) if before_call.is_none() => match step.place {
                CodeLocation::Inside(target) => {
                    before_call = Some(StackUse { saved, room: 0 });
                    at = target;
                }
                _ => return StackUse { saved, room: 0 },
            },
            Some(AsmOperation::Jump(..)) if before_call.is_some() => match step.place {
                CodeLocation::Inside(target) => at = target,
                _ => return before_call.unwrap_or_default(),
            },
            // The shared routine returns.
            Some(AsmOperation::JumpPointer) if before_call.is_some() => {
                return StackUse { saved, room: if has_pointer { room } else { 0 } };
            }
            _ => return before_call.unwrap_or(StackUse { saved, room: 0 }),
        }
    }
}
