//! Which values instructions are for, so that programs do not all end with the first one.

use bittybuzz_vm_core::builtin::{self, Library};
use bittybuzz_vm_core::opcode;

/// What is known of a value: nothing, or its type.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    Any,
    Number,
    String,
    Table,
    Function,
}

use Kind::{Any, Function, Number, String, Table};

/// What a global is for.
pub fn of_global(number: usize) -> Kind {
    [Table, Number, Function, Any][number % 4]
}

/// The kinds of values that an instruction is for, topmost last.
pub fn wanted(opcode: u8) -> &'static [Kind] {
    match opcode {
        opcode::BAND..=opcode::POW | opcode::ADD..=opcode::MOD => &[Number; 2],
        opcode::LT..=opcode::GE => &[Number; 2],
        opcode::JUMP_LT..=opcode::JUMP_NOT_LT => &[Number; 2],
        opcode::NEG | opcode::BNOT | opcode::ADD_INT => &[Number],
        opcode::JUMP_LT_INT..=opcode::JUMP_NOT_LT_INT => &[Number],
        opcode::INDEX_GET | opcode::INDEX_METHOD => &[Table, Number],
        opcode::INDEX_INIT | opcode::INDEX_SET => &[Table, Number, Any],
        opcode::FIELD_GET | opcode::FIELD_METHOD => &[Table],
        opcode::FIELD_SET | opcode::FIELD_INIT => &[Table, Any],
        opcode::CALL => &[Function],
        opcode::CALL_METHOD => &[Table, Function],
        _ => &[Any; 3],
    }
}

/// The kinds of values that a built-in is for.
pub fn arguments(builtin: &builtin::BuiltinInfo) -> &'static [Kind] {
    match (builtin.number, builtin.library) {
        (builtin::SIZE | builtin::CLONE, _) => &[Table],
        (builtin::FOREACH..=builtin::REDUCE, _) => &[Table, Function, Any],
        (_, Library::Math | Library::Rng) => &[Number; 2],
        (builtin::SUB, _) => &[String, Number, Number],
        (builtin::TO_STRING, _) => &[Any],
        (_, Library::String) => &[String; 3],
        _ => &[Any; 3],
    }
}

/// The kind of what an instruction leaves on top.
pub fn made(opcode: u8) -> Kind {
    match opcode {
        opcode::TABLE_NEW | opcode::INDEX_INIT | opcode::FIELD_INIT | opcode::LIBRARY => Table,
        opcode::INT | opcode::INT_WORD | opcode::FLOAT | opcode::FLOAT_HALF | opcode::ADD_INT => {
            Number
        }
        opcode::NOT..=opcode::GE | opcode::NEG..=opcode::BNOT => Number,
        opcode::BAND..=opcode::POW | opcode::ADD..=opcode::MOD => Number,
        opcode::STRING => String,
        opcode::FUNCTION | opcode::BUILTIN | opcode::ROBOT | opcode::CLOSURE => Function,
        _ => Any,
    }
}
