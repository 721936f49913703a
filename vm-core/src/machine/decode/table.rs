//! The decoder whose jump table has every byte, including short and wide forms.

use crate::bytecode::ByteCode;
use crate::opcode::{self, WIDE};

/// The bytes of a short form, as patterns of the jump table. A range would be tested separately,
/// before or after the table.
#[rustfmt::skip]
macro_rules! short {
    (LOCAL_GET) => {
        0x80 | 0x81 | 0x82 | 0x83 | 0x84 | 0x85 | 0x86 | 0x87 | 0x88 | 0x89 | 0x8a | 0x8b | 0x8c | 0x8d | 0x8e | 0x8f
    };
    (INT) => {
        0x90 | 0x91 | 0x92 | 0x93 | 0x94 | 0x95 | 0x96 | 0x97 | 0x98 | 0x99 | 0x9a | 0x9b | 0x9c | 0x9d | 0x9e | 0x9f
    };
    (GLOBAL_GET) => {
        0xa0 | 0xa1 | 0xa2 | 0xa3 | 0xa4 | 0xa5 | 0xa6 | 0xa7 | 0xa8 | 0xa9 | 0xaa | 0xab | 0xac | 0xad | 0xae | 0xaf
    };
    (GLOBAL_SET) => { 0xb0 | 0xb1 | 0xb2 | 0xb3 | 0xb4 | 0xb5 | 0xb6 | 0xb7 };
    // `RETURN` and `RETURN_NIL`.
    (RETURN) => { 0xb8 | 0xb9 | 0xba | 0xbb | 0xbc | 0xbd | 0xbe | 0xbf };
}
pub(in crate::machine) use short;

/// Returns the byte at `pc`, and the next one as an operand. Only the arm in the jump table knows
/// if the instruction has an operand.
#[hot]
pub(in crate::machine) fn fetch<C: ByteCode>(code: C, pc: usize) -> (u8, isize) {
    let [first, next] = code.word(pc).to_le_bytes();
    (first, isize::from(next as i8))
}

/// Returns the operand of a short `LOCAL_GET`.
#[hot]
pub(in crate::machine) fn short_local(op: u8) -> isize {
    isize::from(op & 0x0f) + opcode::SHORT_LOCAL_GET.low as isize
}

/// Returns the operand of a short `INT`.
#[hot]
pub(in crate::machine) fn short_int(op: u8) -> i32 {
    i32::from(op & 0x0f) + i32::from(opcode::SHORT_INT.low)
}

/// Returns opcode and operand of the other short forms.
#[hot]
pub(in crate::machine) fn short_other(op: u8) -> (u8, isize) {
    match op & 0x0c {
        0x08 => (opcode::RETURN, isize::from(op & 0x03)),
        0x0c => (opcode::RETURN_NIL, isize::from(op & 0x03)),
        _ => (opcode::GLOBAL_SET, isize::from(op & 0x07)),
    }
}

/// Returns opcode and operand of a wide form; `pc` is after its first byte.
#[hot]
pub(in crate::machine) fn wide<C: ByteCode>(code: C, pc: usize, op: u8) -> (u8, isize) {
    (op & !WIDE, isize::from(code.word(pc) as i16))
}
