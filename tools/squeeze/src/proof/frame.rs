//! The beginning of a function: registers that it saves and room for its variables; and who reads the stack above them.

use std::collections::HashMap;

use super::decode::{Op, Pair, flag};
use super::program::{AssemblyProgram, Place, Routine};
use super::run::{Event, Run, SAVED};

/// The part of the stack that a function takes when it begins.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StackUse {
    /// Bytes of registers that it saves.
    pub saved: u16,
    /// Bytes of its variables.
    pub room: u16,
}

/// Instructions that access the part of the stack above a function's own variables, each time they are executed.
#[derive(Default)]
pub struct StackAccesses {
    /// Executions, and those of them that did.
    counts: HashMap<usize, (u32, u32)>,
}

impl StackAccesses {
    /// Counts the accesses of an execution.
    pub fn take(&mut self, run: &Run, frame: StackUse) {
        /// Bytes of arguments that are looked at.
        const ABOVE: u16 = 64;
        let top = run.before.stack;
        let lowest = top - 1 - frame.saved;
        for event in &run.events {
            if let Event::Load(address) | Event::Store(address, _) = event.event {
                let (all, hits) = self.counts.entry(event.step).or_default();
                *all += 1;
                *hits += u32::from((lowest..=top + ABOVE).contains(&address));
            }
        }
    }

    /// An instruction that never accessed anything else.
    pub fn found(&self) -> Option<usize> {
        let always = |(_, (all, hits)): &(&usize, &(u32, u32))| all == hits && *all >= 3;
        self.counts.iter().filter(always).map(|(step, _)| *step).min()
    }
}

/// The frame that a function makes before anything else, itself or by a shared routine.
pub fn frame(program: &AssemblyProgram, routine: &Routine, is_interrupt: bool) -> StackUse {
    let mut at = routine.start;
    let mut saved = 0;
    let mut room = 0;
    // True once Y holds the stack pointer; the size that a shared routine gets.
    let mut has_pointer = false;
    let mut shared_size = 0;
    // The frame as it was before a call, which may be one of another routine.
    let mut before_call: Option<StackUse> = None;
    loop {
        let step = &program.steps[at];
        at += 1;
        match step.op {
            // Only saved registers: another one may be an argument for a callee.
            Some(Op::Push(register))
                if !has_pointer && (is_interrupt || SAVED >> register & 1 != 0) =>
            {
                saved += 1;
            }
            Some(Op::In(0, 0x3f) | Op::Pair(Pair::Eor, 1, 1)) if is_interrupt => {}
            // A shared routine takes its return address from the stack first.
            Some(Op::Pop(30 | 31)) if before_call.is_some() => {}
            Some(Op::In(28, 0x3d)) => has_pointer = true,
            Some(Op::In(29, 0x3e) | Op::Out(0x3e, 29)) if has_pointer => {}
            Some(Op::In(0, 0x3f) | Op::Flag(flag::I, false) | Op::Out(0x3f, 0)) if has_pointer => {}
            Some(Op::Word(28, value, true)) if has_pointer => room = u16::from(value),
            Some(Op::Constant(Pair::Sub, 28, value)) if has_pointer => room = u16::from(value),
            Some(Op::Constant(Pair::Sbc, 29, value)) if has_pointer => {
                room |= u16::from(value) << 8;
            }
            Some(Op::Load(26, value)) if before_call.is_none() => shared_size = u16::from(value),
            Some(Op::Pair(Pair::Sub, 28, 26)) if before_call.is_some() => room = shared_size,
            Some(Op::Pair(Pair::Sbc, 29, 1)) if before_call.is_some() => {}
            Some(Op::Out(0x3d, 28)) if has_pointer => {
                if before_call.is_none() {
                    return StackUse { saved, room };
                }
            }
            Some(Op::Call(..)) if before_call.is_none() => match step.place {
                Place::Inside(target) => {
                    before_call = Some(StackUse { saved, room: 0 });
                    at = target;
                }
                _ => return StackUse { saved, room: 0 },
            },
            Some(Op::Jump(..)) if before_call.is_some() => match step.place {
                Place::Inside(target) => at = target,
                _ => return before_call.unwrap_or_default(),
            },
            // Back from a shared routine.
            Some(Op::JumpPointer) if before_call.is_some() => {
                return StackUse { saved, room: if has_pointer { room } else { 0 } };
            }
            _ => return before_call.unwrap_or(StackUse { saved, room: 0 }),
        }
    }
}
