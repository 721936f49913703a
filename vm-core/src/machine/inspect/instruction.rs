//! The next instruction, with its operands and the locals of its function.

use super::super::{SPECIAL, Vm, VmState};
use crate::bytecode::ByteCode;
use crate::number::Profile;
use crate::opcode::{self, Decoded};
use crate::rom::Effect;
use crate::value::{Tag, Value};

/// An instruction in a function of the script.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Instruction {
    /// Offset of its first byte from the start of the code.
    pub start: u16,
    /// Offset of its last byte, by which faults and symbols name the instruction.
    pub position: u16,
    /// First byte, as the image has it.
    pub first_byte: u8,
    /// The plain or narrow opcode, also for short and wide forms.
    pub opcode: u8,
    /// Operand, 0 if there is none.
    pub operand: i16,
    /// The first byte of the [`Trailer`](opcode::Trailer); arbitrary if there is none.
    pub trailer: u8,
}

/// A value as the callee of a call.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Callee {
    /// A built-in function, by its number in [`builtin`](crate::builtin).
    Builtin(u8),
    /// A function with captured values.
    Closure,
    /// Any other value.
    Other,
}

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    /// Returns the instruction that is executed next; `None` if no entry is running, or if the
    /// machine continues in a built-in.
    pub fn next_instruction(&self) -> Option<Instruction> {
        let at = usize::from(self.pc);
        let program = self.program().filter(|_| self.state == VmState::Running && at < SPECIAL)?;
        let byte = |offset| program.code.byte(at + offset);
        let first_byte = byte(0);
        let Decoded { opcode, operand, length } = opcode::decode([first_byte, byte(1), byte(2)]);
        let length = usize::from(length);
        let start = at.wrapping_sub(usize::from(program.header().code_at()));
        let end = start.wrapping_add(length + Effect::of::<P, C>(opcode).trailer());
        Some(Instruction {
            start: start as u16,
            position: end.wrapping_sub(1) as u16,
            first_byte,
            opcode,
            operand,
            trailer: byte(length),
        })
    }

    /// Returns an operand of the next instruction by its distance below the stack pointer: 1 is the
    /// top of the stack.
    pub fn operand(&self, below: u8) -> Value<P> {
        self.top(below)
    }

    /// Returns a local of the running function by its offset from the frame, as instructions name
    /// it.
    pub fn frame_local(&self, number: i16) -> Value<P> {
        self.arena.get(self.local_slot(number))
    }

    /// Returns true if the first value is a table in which the second one, an integer, is no key.
    pub fn is_missing(&self, table: Value<P>, key: Value<P>) -> bool {
        table.is(Tag::TABLE)
            && key.is(Tag::INT)
            && self.arena.table_get(table.index(), key).is_nil()
    }

    /// Returns the kind of function that a call of this value runs.
    pub fn callee(&self, value: Value<P>) -> Callee {
        let function = match value.tag() {
            Tag::BOUND => self.arena.closure_function(value.index()),
            _ => value,
        };
        match function.tag() {
            Tag::BUILTIN => Callee::Builtin(function.index() as u8),
            Tag::CLOSURE => Callee::Closure,
            _ => Callee::Other,
        }
    }

    /// Returns the slot of the running frame's record. A called function has a higher slot than its
    /// caller.
    pub fn frame(&self) -> u16 {
        self.fp
    }
}
